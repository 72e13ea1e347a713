// Reads a task set, runs its threads on the virtual clock, and writes the greatest response time of each task.
//
//   CPUs (a mask), instant of the last release
//   for each task: period, offset, priority, CPUs, the number of releases in a period and the tasks whose jobs write what releases it,
//   any of them (1,2) or all (1&2), or -1 and -1, the task whose thread it shares, or -1, followed by `q` if that thread executes jobs in
//   the order of their releases and by `n` if its jobs are not preempted, the number of times, the execution times of its jobs, again and
//   again

#include <cstdint>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "context.hpp"
#include "mauve/thread.hpp"
#include "rtt/InputPort.hpp"
#include "rtt/OutputPort.hpp"
#include "virtual_clock.hpp"

namespace {

struct Task : RTT::base::RunnableInterface {
  Task(const std::string& name, const mauve::Scheduling& scheduling) : thread(name, scheduling) {}

  bool step() override {
    // In two parts, as a program with two codels.
    const mauve::Nanoseconds time = times[jobs++ % times.size()];
    mauve::timeline().spend(*thread.context().worker, time / 3);
    mauve::timeline().spend(*thread.context().worker, time - time / 3);
    out.write(1);
    return true;
  }
  void serve() override {}

  std::vector<mauve::Nanoseconds> times;
  std::size_t jobs = 0;
  mauve::Nanoseconds offset = 0;
  std::vector<std::unique_ptr<RTT::InputPort<int>>> in;
  RTT::OutputPort<int> out;
  mauve::PeriodicThread thread;
};

}  // namespace

int main() {
  std::uint64_t cpus = 0, own_cpus = 0;
  mauve::Nanoseconds end = 0;
  std::cin >> cpus >> end;
  mauve::VirtualClock clock(cpus);
  mauve::set_timeline(clock);
  std::vector<std::unique_ptr<Task>> tasks;
  mauve::Scheduling scheduling;
  mauve::Nanoseconds offset = 0;
  std::size_t count = 0;
  int burst = -1;
  std::string sources, thread;
  while (std::cin >> scheduling.period >> offset >> scheduling.priority >> own_cpus >> burst >> sources >> thread >> count) {
    scheduling.cpus = own_cpus;
    tasks.emplace_back(new Task(std::to_string(tasks.size()), scheduling));
    Task& task = *tasks.back();
    task.offset = offset;
    task.times.resize(count);
    for (mauve::Nanoseconds& time : task.times) std::cin >> time;
    task.thread.hold();
    std::istringstream in(sources);
    for (int source = -1; in >> source && source >= 0; in.ignore()) {
      task.in.emplace_back(new RTT::InputPort<int>("in" + std::to_string(source)));
      tasks.at(static_cast<std::size_t>(source))->out.connectTo(task.in.back().get(), RTT::ConnPolicy::data());
      const bool needs_all = sources.find('&') != std::string::npos;
      task.thread.release_by(*task.in.back(), static_cast<std::uint64_t>(burst), needs_all);
    }
    const int leader = std::stoi(thread);
    if (leader >= 0) {
      mauve::PeriodicThread& other = tasks.at(static_cast<std::size_t>(leader))->thread;
      if (thread.find('q') != std::string::npos) {
        task.thread.queue_in(other);
      } else {
        task.thread.run_in(other);
      }
    }
    if (thread.find('n') != std::string::npos) task.thread.set_not_preempted();
    task.thread.start(&task);
    task.thread.release_until(end);
  }
  for (const auto& task : tasks) task->thread.release_at(task->offset);
  if (clock.run(10, [] { return false; }) != mauve::VirtualClock::End::Idle) return 1;
  clock.finish();
  for (const auto& task : tasks) {
    task->thread.stop();
    std::cout << task->thread.statistics().periods << " " << task->thread.statistics().response << std::endl;
  }
  return 0;
}
