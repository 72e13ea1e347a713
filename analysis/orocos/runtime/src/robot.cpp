#include "mauve/robot.hpp"

#include <dlfcn.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <map>
#include <set>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include "chains.hpp"
#include "context.hpp"
#include "mauve/gateway.hpp"
#include "mauve/inputs.hpp"
#include "mauve/stub.hpp"
#include "options.hpp"
#include "other_threads.hpp"
#include "report.hpp"
#include "rtt/Activity.hpp"
#include "rtt/Logger.hpp"
#include "rtt/OperationCaller.hpp"
#include "rtt/TaskContext.hpp"
#include "supervisor.hpp"
#include "timeline.hpp"
#include "trace_file.hpp"
#include "virtual_clock.hpp"

#define MAUVE_TEXT2(x) #x
#define MAUVE_TEXT(x) MAUVE_TEXT2(x)

namespace mauve {
namespace {

constexpr Nanoseconds second = 1000000000;
// What a period may still take when the robot should end.
constexpr Nanoseconds grace = 3 * second;
// What code may take on the virtual clock, without taking time there.
constexpr int patience_s = 60;
// From the start of all instances to the first release: all threads wait by then.
constexpr Nanoseconds before_start = 20000000;

struct Cannot : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct InstanceData {
  std::string name, package, type;
};

struct ValueData {
  std::string instance, property, value;
};

struct ConnectionData {
  std::string from, to;
  int buffer;
};

struct ActivityData {
  std::string instance;
  Nanoseconds period;
  int priority;
  Cpus cpus;
  Nanoseconds offset, deadline, bound;
  // The instance whose thread executes it, if it is another one; whether it has releases of its own then; and whether a period that has
  // begun has the highest priority.
  std::string thread;
  bool is_queued, is_not_preempted;
  // The inputs whose data release it, if some do, and whether it needs data at each.
  std::vector<std::string> inputs;
  std::uint64_t burst;
  bool needs_all;
  // Executes its periods instead of a component, if there is one.
  Gateway* gateway;
};

// Real-time work that is not in the model.
struct OtherWork : RTT::base::RunnableInterface {
  OtherWork(const std::string& name, const Scheduling& scheduling, Nanoseconds time)
      : time_(time), thread(name, scheduling) {}
  bool step() override {
    timeline().spend(*thread.context().worker, time_);
    return true;
  }
  void serve() override {}

 private:
  const Nanoseconds time_;

 public:
  PeriodicThread thread;
};

bool has_failed(const RTT::TaskContext& task) {
  const RTT::TaskContext::TaskState state = task.getTaskState();
  return task.hasThrown() || state == RTT::TaskContext::Exception || state == RTT::TaskContext::FatalError;
}

// The instance and the feature of `pilot.speed`.
std::pair<std::string, std::string> parts(const std::string& end) {
  const std::size_t dot = end.find('.');
  return {end.substr(0, dot), dot == std::string::npos ? "" : end.substr(dot + 1)};
}

std::string joined(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += (out.empty() ? "" : ", ") + text;
  return out;
}

// The numbers of these CPUs, the first one of which is `first`.
std::string numbers_of(const Cpus& cpus, std::size_t first) {
  std::vector<std::string> numbers;
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
    if (cpus[cpu]) numbers.push_back(std::to_string(cpu + first));
  }
  return joined(numbers);
}

bool is_scheduled(int thread, int priority, const Cpus& cpus) {
  sched_param parameter = {};
  cpu_set_t set;
  if (thread == 0 || sched_getparam(thread, &parameter) != 0 || sched_getaffinity(thread, sizeof set, &set) != 0) return false;
  if (sched_getscheduler(thread) != (priority > 0 ? SCHED_FIFO : SCHED_OTHER) || parameter.sched_priority != priority) return false;
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
    if (cpus.any() && cpus[cpu] != (CPU_ISSET(cpu, &set) != 0)) return false;
  }
  return true;
}

RTT::TaskContext* create(const InstanceData& instance) {
  const std::string file = "lib" + instance.package + "-components-" MAUVE_TEXT(OROCOS_TARGET) ".so";
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (library == nullptr) throw Cannot("package " + instance.package + " cannot be loaded: " + dlerror());
  typedef RTT::TaskContext* OneOf(std::string, std::string);
  typedef RTT::TaskContext* Only(std::string);
  typedef std::string TypeOfOnly();
  // Types are written as their package writes them, with `::` before them or not.
  for (const std::string& type : {instance.type, "::" + instance.type}) {
    if (const auto one_of = reinterpret_cast<OneOf*>(dlsym(library, "createComponentType"))) {
      if (RTT::TaskContext* const task = one_of(instance.name, type)) return task;
    } else if (const auto only = reinterpret_cast<Only*>(dlsym(library, "createComponent"))) {
      const auto name = reinterpret_cast<TypeOfOnly*>(dlsym(library, "getComponentType"));
      if (name != nullptr && name() == type) return only(instance.name);
    }
  }
  throw Cannot("package " + instance.package + " has no component " + instance.type + ": build it again");
}

}  // namespace

struct Robot::State {
  State(const std::string& name, const std::string& built_by) : deployment(name), build(built_by) {}
  // The threads that are left end with their tasks.
  ~State() {
    if (virtual_clock) virtual_clock->finish();
    // Before the task of anything that they execute.
    for (PeriodicThread* thread : threads) thread->stop();
  }

  RTT::TaskContext& task(const std::string& name) const;
  void create_instances();
  void set(const ValueData& value);
  template <class... A>
  bool tell(const std::string& instance, const char* operation, A... arguments) const;
  void connect_all();
  void connect_gateways() const;
  void open_gateways();
  void close_gateways() const;
  void remove_gateways();
  void check_rights() const;
  void lock_memory() const;
  void create_activities();
  void set_releases(const ActivityData& activity, PeriodicThread& thread);
  void check_threads();
  void configure();
  void start();
  void release();
  void wait_for_end();
  void stop();
  std::string stuck() const;
  std::vector<Row> rows() const;
  bool is_live() const;
  void show(bool is_first) const;
  Causes causes() const;
  int report() const;
  int run();
  bool drain();
  void end_releases();
  void release_until(Nanoseconds end);
  int greatest_priority() const;
  Cpus all_cpus() const;

  const std::string deployment, build;
  std::vector<InstanceData> instances;
  std::vector<ValueData> values;
  std::vector<ConnectionData> connections, operations;
  std::vector<ActivityData> activities;
  struct OtherData {
    std::string name;
    Scheduling scheduling;
    Nanoseconds time;
  };
  std::vector<OtherData> others;
  ExecutionTimes times;
  Nanoseconds overhead = 0;

  Options options;
  std::unique_ptr<VirtualClock> virtual_clock;
  std::vector<ObservedChain> chains;
  // What the threads record, for the trace and the chains.
  std::unique_ptr<TraceQueue> records;
  std::unique_ptr<TraceFile> trace;
  OtherThreads other_threads_of_process;
  std::vector<Work> work;
  std::map<std::string, std::unique_ptr<RTT::TaskContext>> tasks;
  // In the order of `activities`.
  std::vector<PeriodicThread*> threads;
  std::vector<std::unique_ptr<OtherWork>> other_threads;
  std::vector<std::unique_ptr<PeriodicThread>> gateway_threads;
  std::unique_ptr<Supervisor> supervisor;
  // What the main thread does, for the message if it does not end.
  std::atomic<const char*> doing{""};
  std::atomic<const std::string*> doing_with{nullptr};
  // Whether `threads` is complete: the supervisor looks at it from then on.
  std::atomic<bool> has_threads{false};
  std::atomic<Nanoseconds> began{0};
  Nanoseconds ended = 0;
};

RTT::TaskContext& Robot::State::task(const std::string& name) const {
  const auto found = tasks.find(name);
  if (found != tasks.end()) return *found->second;
  std::vector<std::string> names;
  for (const auto& it : tasks) names.push_back(it.first);
  throw Cannot("no instance " + name + " in " + deployment + ", which has " + joined(names));
}

void Robot::State::create_instances() {
  for (const InstanceData& it : instances) tasks[it.name].reset(create(it));
}

void Robot::State::set(const ValueData& value) {
  RTT::TaskContext& task = this->task(value.instance);
  RTT::base::PropertyBase* const property = task.getProperty(value.property);
  if (property == nullptr) {
    const std::string names = joined(task.propertyNames());
    throw Cannot(value.instance + " has no property " + value.property + (names.empty() ? ": it has none" : "; it has " + names));
  }
  if (!property->setText(value.value)) {
    throw Cannot("property " + value.instance + "." + value.property + " cannot be `" + value.value + "`");
  }
}

// Calls an operation of generated code, which other components may not have. Returns its result, or true.
template <class... A>
bool Robot::State::tell(const std::string& instance, const char* operation, A... arguments) const {
  RTT::TaskContext deployer("deployer");
  RTT::OperationCaller<bool(A...)> caller(operation);
  RTT::ServiceRequester requester(deployer.engine());
  requester.addOperationCaller(caller);
  return !requester.connect(operation, task(instance).provides(), operation) || caller.call(arguments...);
}

void Robot::State::connect_all() {
  for (const ConnectionData& it : connections) {
    const auto from = parts(it.from), to = parts(it.to);
    RTT::base::PortInterface* const output = task(from.first).getPort(from.second);
    RTT::base::PortInterface* const input = task(to.first).getPort(to.second);
    const RTT::ConnPolicy policy =
        it.buffer == 0 ? RTT::ConnPolicy::data() : RTT::ConnPolicy::circularBuffer(it.buffer);
    if (output == nullptr || input == nullptr || !output->connectTo(input, policy)) {
      throw Cannot(it.from + " cannot be connected with " + it.to + ": build their packages again");
    }
    // Each component clears its buffers when it starts.
    if (it.buffer > 0) tell<const std::string&>(to.first, "mauve_has_buffer", to.second);
  }
  for (const ConnectionData& it : operations) {
    const auto required = parts(it.from), provided = parts(it.to);
    if (!task(required.first).requires()->connect(required.second, task(provided.first).provides(), provided.second)) {
      throw Cannot(it.from + " cannot be connected with " + it.to + ": build their packages again");
    }
  }
}

void Robot::State::connect_gateways() const {
  for (const ActivityData& it : activities) {
    if (it.gateway == nullptr) continue;
    for (const Gateway::End& end : it.gateway->ends()) {
      RTT::base::PortInterface* const port = task(end.instance).getPort(end.port);
      const RTT::ConnPolicy policy = end.buffer == 0 ? RTT::ConnPolicy::data() : RTT::ConnPolicy::circularBuffer(end.buffer);
      if (port == nullptr || !(end.is_output ? port->connectTo(end.own, policy) : end.own->connectTo(port, policy))) {
        throw Cannot(end.instance + "." + end.port + " cannot be connected with " + it.instance + ": build its package again");
      }
      // As for connections of instances.
      if (!end.is_output && end.buffer > 0) tell<const std::string&>(end.instance, "mauve_has_buffer", end.port);
    }
  }
}

// From here on, others may see the robot.
void Robot::State::open_gateways() {
  for (const ActivityData& it : activities) {
    if (it.gateway == nullptr) continue;
    doing_with = &it.instance;
    doing = "open";
    it.gateway->open(options.allows_non_realtime);
  }
}

// Nobody outside is on the virtual clock.
void Robot::State::remove_gateways() {
  for (const ActivityData& it : activities) {
    if (it.gateway != nullptr) std::cout << it.gateway->absence() << std::endl;
  }
  const auto is_gateway = [](const ActivityData& it) { return it.gateway != nullptr; };
  activities.erase(std::remove_if(activities.begin(), activities.end(), is_gateway), activities.end());
}

void Robot::State::close_gateways() const {
  for (const ActivityData& it : activities) {
    if (it.gateway != nullptr) it.gateway->close();
  }
}

int Robot::State::greatest_priority() const {
  int greatest = 0;
  for (const ActivityData& it : activities) greatest = std::max(greatest, it.is_not_preempted ? highest_priority : it.priority);
  return greatest;
}

Cpus Robot::State::all_cpus() const {
  Cpus cpus;
  for (const ActivityData& it : activities) cpus |= it.cpus;
  for (const OtherData& it : others) cpus |= it.scheduling.cpus;
  return cpus.none() ? Cpus(1) : cpus;
}

// Without them the threads would run all the same, and later than the analysis says.
void Robot::State::check_rights() const {
  const int priority = greatest_priority();
  if (priority == 0) return;
  Cpus missing;
  cpu_set_t present;
  if (sched_getaffinity(0, sizeof present, &present) == 0) {
    missing = all_cpus();
    for (std::size_t cpu = 0; cpu < missing.size(); ++cpu) {
      if (CPU_ISSET(cpu, &present)) missing.reset(cpu);
    }
  }
  int error = 0;
  std::thread probe([&] {
    sched_param parameter = {};
    parameter.sched_priority = priority;
    error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  });
  probe.join();
  const std::string otherwise = "; --simulate-time needs none of this, and with --allow-non-realtime the response times do not hold";
  if (error != 0) {
    rlimit limit = {};
    getrlimit(RLIMIT_RTPRIO, &limit);
    throw Cannot("this user may not run threads with SCHED_FIFO and priority " + std::to_string(priority) +
                 " (`ulimit -r` allows " + std::to_string(limit.rlim_cur) +
                 "): allow it with `rtprio` in /etc/security/limits.conf, or run as root" + otherwise);
  }
  if (missing.any()) {
    throw Cannot("CPU " + numbers_of(missing, 1) + " of the deployment is not available to this program" + otherwise);
  }
}

// A page that is not in the memory would delay whoever needs it: loads all of the components, and keeps what comes later. (The
// stacks of threads are greater than what they use, and come into the memory as they are used.)
void Robot::State::lock_memory() const {
#ifdef MCL_ONFAULT
  const int later = MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT;
#else
  const int later = MCL_CURRENT | MCL_FUTURE;
#endif
  if (mlockall(MCL_CURRENT) != 0 || mlockall(later) != 0) {
    RTT::log(RTT::Warning) << "the memory cannot be locked (" << std::strerror(errno)
                           << "; `ulimit -l` shows the limit): page faults may delay periods" << RTT::endlog();
  }
}

void Robot::State::create_activities() {
  for (const ActivityData& it : activities) {
    std::unique_ptr<RTT::Activity> activity;
    if (it.gateway == nullptr) {
      activity.reset(new RTT::Activity(it.priority > 0 ? ORO_SCHED_RT : ORO_SCHED_OTHER, it.priority,
                                       1e-9 * static_cast<double>(it.period), 0u, nullptr, it.instance));
    } else {
      gateway_threads.emplace_back(new PeriodicThread(it.instance, {it.priority, it.period, it.cpus}));
    }
    PeriodicThread& thread = activity ? activity->thread() : *gateway_threads.back();
    thread.set_period(it.period);
    thread.set_cpus(it.cpus);
    thread.hold();
    thread.set_deadline(it.deadline);
    if (it.priority == 0) thread.release_after_beginnings();
    set_releases(it, thread);
    Context& context = thread.context();
    if (options.simulates_time || options.spends_times) context.times = &times;
    context.spent_percent = 80;
    (trace ? context.trace : context.followed) = records.get();
    // A thread wakes up once for all that it executes in a period.
    if (it.priority > 0 && (it.thread.empty() || it.is_queued)) thread.set_overhead(overhead);
    if (it.is_not_preempted) thread.set_not_preempted();
    threads.push_back(&thread);
    if (activity ? !task(it.instance).setActivity(activity.release()) : !thread.start(it.gateway)) {
      throw Cannot("the activity of " + it.instance + " cannot be created");
    }
  }
  if (!options.simulates_time) return;
  for (const OtherData& it : others) {
    other_threads.emplace_back(new OtherWork(it.name, it.scheduling, it.time));
    PeriodicThread& thread = other_threads.back()->thread;
    thread.hold();
    thread.start(other_threads.back().get());
  }
}

void Robot::State::set_releases(const ActivityData& activity, PeriodicThread& thread) {
  for (const std::string& name : activity.inputs) {
    RTT::base::PortInterface* const input = task(activity.instance).getPort(name);
    if (input == nullptr || !thread.release_by(*input, activity.burst, activity.needs_all)) {
      throw Cannot(activity.instance + " has no input " + name + ": build its package again");
    }
    tell<const std::string&, double, unsigned int, bool>(activity.instance, "mauve_released_by", name,
                                                         1e-9 * static_cast<double>(activity.period),
                                                         static_cast<unsigned int>(activity.burst), activity.needs_all);
  }
  for (std::size_t index = 0; index < threads.size(); ++index) {
    if (activities[index].instance != activity.thread) continue;
    if (activity.is_queued) {
      thread.queue_in(*threads[index]);
    } else {
      thread.run_in(*threads[index]);
    }
  }
  if (activity.is_not_preempted) tell(activity.instance, "mauve_is_not_preempted");
}

// Each component looks in its thread whether it has what was analysed: see `mauve_runs_as` in generated code.
void Robot::State::check_threads() {
  bool is_fine = true;
  for (std::size_t index = 0; index < activities.size(); ++index) {
    const ActivityData& it = activities[index];
    if (it.gateway != nullptr) {
      // Its thread may not have begun.
      const auto is_scheduled = [&] { return mauve::is_scheduled(threads[index]->number(), it.priority, it.cpus); };
      for (int pauses = 0; pauses < 10000 && !is_scheduled(); ++pauses) pause();
      is_fine = (options.allows_non_realtime || is_scheduled()) && is_fine;
      continue;
    }
    const bool is_mask = (it.cpus >> 32).none();
    if (!is_mask) tell<const std::string&>(it.instance, "mauve_runs_on", numbers_of(it.cpus, 0));
    const unsigned int mask = is_mask ? static_cast<unsigned int>(it.cpus.to_ulong()) : 0;
    is_fine = tell<int, unsigned int>(it.instance, "mauve_runs_as", it.priority, mask) && is_fine;
  }
  if (!is_fine) throw Cannot("threads are not scheduled as analysed, see above");
}

void Robot::State::configure() {
  for (const InstanceData& it : instances) {
    doing_with = &it.name;
    doing = "configure";
    if (supervisor->should_end()) return;
    if (!task(it.name).configure()) throw Cannot(it.name + " cannot be configured");
  }
}

void Robot::State::start() {
  for (const InstanceData& it : instances) {
    doing_with = &it.name;
    doing = "start";
    if (supervisor->should_end()) return;
    if (!task(it.name).start()) throw Cannot(it.name + " cannot be started");
  }
}

// Writes and follows what the threads have recorded since the last call. Returns whether there was anything.
bool Robot::State::drain() {
  if (!records) return false;
  const std::vector<TraceRecord>& taken = records->take();
  const std::uint64_t lost = records->lost();
  if (trace) trace->write(taken, lost);
  for (ObservedChain& chain : chains) chain.follow(taken, lost);
  return !taken.empty();
}

// All activities begin at one instant, each at its offset in the first period.
void Robot::State::release() {
  began = options.simulates_time ? Nanoseconds(0) : now() + before_start;
  if (options.length != never) {
    release_until(began + options.length);
    if (!options.simulates_time) supervisor->end_at(began + options.length);
  }
  for (std::size_t index = 0; index < threads.size(); ++index) {
    threads[index]->release_at(began + activities[index].offset);
  }
  // An interruption in the meantime has set an earlier end.
  if (supervisor->should_end() && !options.simulates_time) end_releases();
  for (const auto& it : other_threads) it->thread.release_at(began);
}

void Robot::State::end_releases() {
  release_until(std::min(now(), options.length == never ? never : began + options.length));
}

void Robot::State::release_until(Nanoseconds end) {
  for (PeriodicThread* thread : threads) thread->release_until(end);
  for (const auto& it : other_threads) it->thread.release_until(end);
}

void Robot::State::wait_for_end() {
  doing_with = nullptr;
  doing = "run";
  if (!options.simulates_time) {
    std::set<int> numbers;
    for (const PeriodicThread* thread : threads) numbers.insert(thread->number());
    other_threads_of_process.begin(numbers);
  }
  if (options.simulates_time) {
    bool is_ending = false;
    const auto look = [&] {
      drain();
      if (!supervisor->should_end()) return false;
      if (!is_ending) end_releases();
      is_ending = true;
      return true;
    };
    if (virtual_clock->run(patience_s, look) == VirtualClock::End::Stuck) {
      flush_log();
      std::cerr << "error: " << stuck() << std::endl;
      _exit(1);
    }
    // What follows may hang as well.
    supervisor->end_at(0);
  } else {
    for (int moment = 0; !supervisor->should_end(); ++moment) {
      if (is_live() && moment % 50 == 0) show(moment == 0);
      drain();
      if (moment % 50 == 0) other_threads_of_process.look();
      for (const ActivityData& it : activities) {
        if (it.gateway != nullptr && moment % 50 == 0) it.gateway->look();
      }
      for (int pauses = 0; pauses < 100 && !supervisor->should_end(); ++pauses) pause();
    }
    // What was released before the end is a part of the run. The supervisor ends it if that takes too long.
    const auto has_open = [](const PeriodicThread* thread) { return thread->has_open_period(); };
    for (int pauses = 0; pauses < 20000 && std::any_of(threads.begin(), threads.end(), has_open); ++pauses) pause();
  }
  if (!options.simulates_time) work = other_threads_of_process.end();
  ended = supervisor->is_interrupted() ? std::max(now(), began.load()) : began + options.length;
}

void Robot::State::stop() {
  for (auto it = instances.rbegin(); it != instances.rend(); ++it) {
    doing_with = &it->name;
    doing = "stop";
    RTT::TaskContext& task = this->task(it->name);
    task.stop();
    doing = "clean up";
    if (task.isConfigured()) task.cleanup();
  }
  doing = "end the threads of";
  if (virtual_clock) virtual_clock->finish();
  for (PeriodicThread* thread : threads) thread->stop();
  for (const auto& it : other_threads) it->thread.stop();
  close_gateways();
}

// Says what has not ended.
std::string Robot::State::stuck() const {
  std::string out;
  for (std::size_t index = 0; has_threads && index < threads.size(); ++index) {
    const bool may_be = !virtual_clock || threads[index]->context().worker == virtual_clock->running();
    if (!may_be || !threads[index]->is_busy()) continue;
    const char* const codel = threads[index]->codel();
    out += (out.empty() ? "" : "; ") + activities[index].instance + " does not end its period" +
           (codel == nullptr ? std::string() : std::string(": codel ") + codel + " has not returned");
  }
  if (out.empty()) {
    const std::string* const with = doing_with.load();
    out = std::string("`") + doing.load() + (with == nullptr ? "" : " " + *with) + "` does not end";
  }
  return out + "; the robot is not stopped cleanly";
}

std::vector<Row> Robot::State::rows() const {
  std::vector<Row> rows;
  for (std::size_t index = 0; index < threads.size(); ++index) {
    const ActivityData& it = activities[index];
    const Statistics& statistics = threads[index]->statistics();
    rows.push_back({it.instance, it.priority, it.cpus, it.period, it.priority > 0 ? std::max<Nanoseconds>(it.deadline, 0) : 0, it.bound, statistics.periods,
                    statistics.misses + (threads[index]->is_late() ? 1 : 0), statistics.overruns, statistics.latency, statistics.response,
                    it.gateway == nullptr && has_failed(task(it.instance))});
  }
  return rows;
}

Causes Robot::State::causes() const {
  Causes causes = {{}, {}, {}, ended - began, options.trace_folder};
  for (const Work& it : work) {
    const auto has_it = [&](const ActivityData& activity) { return activity.gateway != nullptr && activity.gateway->has_thread(it.name); };
    // The model has them.
    if (std::none_of(activities.begin(), activities.end(), has_it)) causes.work.push_back(it);
  }
  for (std::size_t index = 0; index < threads.size(); ++index) {
    const Context& context = threads[index]->context();
    for (const CodelStatistics& it : context.codels) {
      if (it.codel != nullptr) causes.codels.push_back({index, it, times.codel(it.codel), times.wait(it.codel)});
    }
    for (const PortStatistics& it : context.ports) {
      if (it.port != nullptr) causes.ports.push_back({index, it, times.access(it.port)});
    }
  }
  return causes;
}

// Whether a table is shown while the robot runs.
bool Robot::State::is_live() const { return options.is_live && !options.simulates_time && isatty(STDOUT_FILENO); }

// Shows the table in place of the one before.
void Robot::State::show(bool is_first) const {
  if (!is_first) std::cout << "\x1b[" << threads.size() + 1 << "A\x1b[J";
  std::cout << table(rows()) << std::flush;
}

int Robot::State::report() const {
  const std::vector<Row> rows = this->rows();
  if (is_live() && ended > 0) std::cout << "\x1b[" << threads.size() + 1 << "A\x1b[J";
  std::cout << deployment << ": " << milliseconds(ended - began) << " ms "
            << (options.simulates_time ? "on a virtual clock"
                                       : options.allows_non_realtime ? "without a guarantee of real time" : "in real time")
            << ", times in ms\n"
            << table(rows);
  bool is_fine = true;
  for (const Row& row : rows) is_fine = is_fine && row.misses == 0 && !row.has_thrown;
  std::cout << explanation(rows, causes()) << table(chains, began);
  for (const ActivityData& it : activities) {
    if (it.gateway != nullptr) std::cout << it.gateway->report();
  }
  for (const ObservedChain& chain : chains) is_fine = is_fine && (chain.limit == 0 || chain.greatest() <= chain.limit);
  std::size_t most = 0;
  // Rounded up: somebody copies it into a table.
  const auto overhead_of = [this](std::size_t index) { return (threads[index]->statistics().overhead.load() + 999) / 1000 * 1000; };
  for (std::size_t index = 1; index < threads.size(); ++index) {
    if (overhead_of(index) > overhead_of(most)) most = index;
  }
  if (!threads.empty() && overhead_of(most) > 0) {
    std::cout << "  overhead: at most " << milliseconds(overhead_of(most)) << " ms of CPU time for a period besides its codels and "
              << "ports, in " << activities[most].instance << "; for a timing table in ms: [overhead] dispatch = "
              << milliseconds(overhead_of(most)) << "\n";
  }
  std::cout << std::flush;
  return is_fine ? 0 : 1;
}

int Robot::State::run() {
  std::string trace_problem;
  if (!options.trace_folder.empty()) {
    trace.reset(new TraceFile(options.trace_folder, build, options.simulates_time || options.spends_times, trace_problem));
    if (!trace_problem.empty()) throw Cannot(trace_problem);
  }
  if (trace || !chains.empty()) records.reset(new TraceQueue());
  if (options.allows_non_realtime) setenv("MAUVE_ALLOW_NON_REALTIME", "true", 1);
  if (options.simulates_time) {
    virtual_clock.reset(new VirtualClock(all_cpus()));
    set_timeline(*virtual_clock);
    if (options.length == never) options.length = 60 * second;
    remove_gateways();
  } else {
    if (!options.allows_non_realtime) check_rights();
    // Memory that is freed stays, and is used again.
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);
  }
  const int priority = options.simulates_time ? 0 : std::min(highest_priority, greatest_priority() + 1);
  supervisor.reset(new Supervisor(priority, grace, [this] {
    // On the virtual clock, the thread of the scheduler does it.
    if (!options.simulates_time && has_threads) end_releases();
  }, [this] { return stuck(); }));
  other_threads_of_process.ignore_present();
  create_instances();
  for (const ValueData& it : values) set(it);
  for (const Parameter& it : options.parameters) set({it.instance, it.property, it.value});
  connect_all();
  connect_gateways();
  if (!options.simulates_time) lock_memory();
  open_gateways();
  create_activities();
  has_threads = true;
  if (!options.simulates_time) check_threads();
  try {
    configure();
    start();
  } catch (const Cannot&) {
    stop();
    throw;
  }
  if (!supervisor->should_end()) {
    release();
    wait_for_end();
  }
  stop();
  supervisor.reset();
  // From now on an interruption ends the program at once.
  unblock_signals();
  flush_log();
  while (drain()) {
  }
  int exit_code = report();
  if (trace) {
    for (const Work& it : work) trace->work(it.name, it.cpu, ended - began);
    std::string problem;
    if (options.records_inputs) problem = trace->put("inputs.toml", recorded_inputs());
    if (problem.empty()) problem = trace->finish();
    if (!problem.empty()) {
      std::cerr << "error: " << problem << std::endl;
      exit_code = std::max(exit_code, 2);
    } else if (!options.simulates_time && !options.spends_times) {
      std::cout << "recorded in " << options.trace_folder << "; next: mauve trace import " << options.trace_folder
                << " -o robot.samples, then mauve pwcet robot.samples" << std::endl;
    }
  }
  return exit_code;
}

Robot::Robot(const std::string& deployment, const std::string& build) : state_(new State(deployment, build)) {}
Robot::~Robot() {}

void Robot::instance(const std::string& name, const std::string& package, const std::string& type) {
  state_->instances.push_back({name, package, type});
}

void Robot::value(const std::string& instance, const std::string& property, const std::string& value) {
  state_->values.push_back({instance, property, value});
}

void Robot::connect(const std::string& output, const std::string& input) { connect(output, input, 0); }

void Robot::connect(const std::string& output, const std::string& input, int buffer) {
  state_->connections.push_back({output, input, buffer});
}

void Robot::operation(const std::string& required, const std::string& provided) {
  state_->operations.push_back({required, provided, 0});
}

void Robot::activity(const std::string& instance, std::int64_t period, int priority, const Cpus& cpus, std::int64_t offset,
                     std::int64_t deadline, std::int64_t response) {
  state_->activities.push_back({instance, period, priority, cpus, offset, deadline, response, "", false, false, {}, 0, false, nullptr});
}

void Robot::gateway(Gateway& gateway, const std::string& name, std::int64_t period, int priority, const Cpus& cpus, std::int64_t deadline,
                    std::int64_t response) {
  state_->activities.push_back({name, period, priority, cpus, 0, deadline, response, "", false, false, {}, 0, false, &gateway});
}

void Robot::run_in(const std::string& instance, const std::string& other) {
  for (ActivityData& it : state_->activities) {
    if (it.instance == instance) it.thread = other;
  }
}

void Robot::queue_in(const std::string& instance, const std::string& other) {
  run_in(instance, other);
  for (ActivityData& it : state_->activities) {
    if (it.instance == instance) it.is_queued = true;
  }
}

void Robot::not_preempted(const std::string& instance) {
  for (ActivityData& it : state_->activities) {
    if (it.instance == instance) it.is_not_preempted = true;
  }
}

void Robot::release_by(const std::string& instance, const std::string& input, std::uint64_t burst, bool needs_all) {
  for (ActivityData& it : state_->activities) {
    if (it.instance != instance) continue;
    it.inputs.push_back(input);
    it.burst = burst;
    it.needs_all = needs_all;
  }
}

void Robot::chain(const std::string& name, std::int64_t bound, std::int64_t limit) {
  state_->chains.emplace_back(name, bound, limit);
}

void Robot::step(const std::string& instance, const std::string& from, const std::string& to) {
  if (!state_->chains.empty()) state_->chains.back().add_step(instance, from, to);
}

void Robot::assume_state(const std::string& instance, const std::string& state) {
  if (!state_->chains.empty()) state_->chains.back().assume_state(instance, state);
}

void Robot::assume_answer(const std::string& instance, const std::string& end) {
  if (!state_->chains.empty()) state_->chains.back().assume_answer(instance, end);
}

void Robot::codel_time(const std::string& codel, std::int64_t time) { state_->times.add(codel, time); }

void Robot::codel_wait(const std::string& codel, std::int64_t time) { state_->times.add_wait(codel, time); }

void Robot::access_time(const std::string& port, std::int64_t time) { state_->times.add_access(port, time); }

void Robot::program_time(const std::string& component, const std::string& state, const std::string& transition,
                         const std::string& program, std::int64_t time) {
  state_->times.add(component, state, transition, program, time);
}

void Robot::overhead(std::int64_t time) { state_->overhead = time; }

void Robot::other_work(const std::string& name, std::int64_t period, std::int64_t time, int priority, const Cpus& cpus) {
  state_->others.push_back({name, {priority, period, cpus}, time});
}

namespace {

// Ends the program even if the end of a static object waits for a thread of a codel, as that of a condition variable does.
void end_for_sure(int exit_code) {
  std::cout.flush();
  try {
    std::thread([exit_code] {
      std::this_thread::sleep_for(std::chrono::nanoseconds(grace));
      const std::string text = "warning: a static object of a codel does not end: does a thread of a codel still use it?\n";
      // The run has ended well.
      _exit(write(STDERR_FILENO, text.data(), text.size()) < 0 ? std::max(exit_code, 1) : exit_code);
    }).detach();
  } catch (const std::system_error&) {
    // Without another thread, the program ends as it can.
  }
}

}  // namespace

int Robot::run(int argc, char** argv) {
  block_signals();
  int exit_code = 0;
  if (!read_options(argc, argv, state_->deployment, state_->options, exit_code)) return exit_code;
  set_log_level(state_->options.log_level);
  try {
    exit_code = state_->run();
    end_for_sure(exit_code);
    return exit_code;
  } catch (const std::exception& error) {
    // The gateways may end before the robot.
    for (PeriodicThread* thread : state_->threads) thread->stop();
    state_->close_gateways();
    flush_log();
    std::cerr << "error: " << error.what() << "; nothing runs" << std::endl;
    return 2;
  }
}

std::uint64_t stub_number() {
  const Context* const context = present_context();
  if (context == nullptr) return 0;
  static thread_local std::uint64_t state = std::hash<std::string>()(context->instance);
  // splitmix64
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t mixed = state;
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return mixed ^ (mixed >> 31);
}

}  // namespace mauve
