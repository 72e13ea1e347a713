// How exactly an activity is released, and what a period costs: on the runtime for Linux or on RTT, beside `cyclictest -m -p 80 -i 1000`.
// Arguments: the period in µs, the number of periods, the priority.

#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <rtt/Activity.hpp>
#include <rtt/TaskContext.hpp>

#include "../rig/main.hpp"

namespace {

std::int64_t read(clockid_t clock) {
  timespec time = {};
  clock_gettime(clock, &time);
  return time.tv_sec * std::int64_t(1000000000) + time.tv_nsec;
}

class Clock : public RTT::TaskContext {
 public:
  explicit Clock(std::size_t count) : RTT::TaskContext("clock") { begins.reserve(count); }

  void updateHook() override {
    if (begins.size() == begins.capacity()) return;
    if (begins.empty()) first_cpu = read(CLOCK_THREAD_CPUTIME_ID);
    begins.push_back(read(CLOCK_MONOTONIC));
    if (begins.size() == begins.capacity()) {
      last_cpu = read(CLOCK_THREAD_CPUTIME_ID);
      is_done = true;
    }
  }

  std::vector<std::int64_t> begins;
  std::int64_t first_cpu = 0, last_cpu = 0;
  std::atomic<bool> is_done{false};
};

}  // namespace

int ORO_main(int argc, char** argv) {
  if (argc != 4) return 2;
  const std::int64_t period = std::atoll(argv[1]) * 1000;
  const std::size_t count = std::strtoul(argv[2], nullptr, 10);
  mlockall(MCL_CURRENT | MCL_FUTURE);
  Clock clock(count);
  clock.setActivity(new RTT::Activity(ORO_SCHED_RT, std::atoi(argv[3]), 1e-9 * static_cast<double>(period), 0u, nullptr, "clock"));
  clock.start();
  while (!clock.is_done) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  clock.stop();
  // Nobody knows the instants of the releases; the earliest beginning was not before its release.
  std::vector<std::int64_t> late;
  for (std::size_t index = 0; index < count; ++index) {
    late.push_back(clock.begins[index] - static_cast<std::int64_t>(index) * period);
  }
  const std::int64_t earliest = *std::min_element(late.begin(), late.end());
  std::int64_t sum = 0;
  for (std::int64_t& it : late) sum += it -= earliest;
  std::sort(late.begin(), late.end());
  std::cout << "jitter: average " << sum / static_cast<std::int64_t>(count) << " ns, 99 % " << late[count * 99 / 100]
            << " ns, greatest " << late.back() << " ns; CPU time of a period "
            << (clock.last_cpu - clock.first_cpu) / static_cast<std::int64_t>(count - 1) << " ns" << std::endl;
  return 0;
}
