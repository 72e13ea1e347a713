#include "mauve/thread.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "context.hpp"
#include "rtt/Logger.hpp"
#include "timeline.hpp"

namespace mauve {
namespace {

// What a thread may use of its stack without a page fault, once its memory is locked.
constexpr std::size_t touched_stack = 64 * 1024;

__attribute__((noinline)) void touch_stack() {
  char stack[touched_stack];
  std::memset(stack, 0, sizeof stack);
  // The compiler may not leave it out.
  asm volatile("" : : "r"(stack) : "memory");
}

cpu_set_t set_of(std::uint64_t cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (unsigned cpu = 0; cpu < 64; ++cpu) {
    if (cpus >> cpu & 1) CPU_SET(cpu, &set);
  }
  return set;
}

// Some of a mask's CPUs may be missing: the kernel would accept the others.
bool set_cpus_of(pthread_t thread, std::uint64_t cpus) {
  const cpu_set_t wanted = set_of(cpus);
  cpu_set_t before, after;
  if (pthread_getaffinity_np(thread, sizeof before, &before) != 0) return false;
  if (pthread_setaffinity_np(thread, sizeof wanted, &wanted) != 0) return false;
  if (pthread_getaffinity_np(thread, sizeof after, &after) == 0 && CPU_EQUAL(&after, &wanted)) return true;
  pthread_setaffinity_np(thread, sizeof before, &before);
  return false;
}

void note_greatest(std::atomic<Nanoseconds>& greatest, Nanoseconds value) {
  if (value > greatest.load(std::memory_order_relaxed)) greatest.store(value, std::memory_order_relaxed);
}

void increment(std::atomic<std::uint64_t>& count) {
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace

struct PeriodicThread::State {
  State(const std::string& name, const Scheduling& scheduling) {
    worker.name = name;
    worker.scheduling = scheduling;
    context.worker = &worker;
    context.instance = name;
    period = scheduling.period;
    cpus = scheduling.cpus;
  }

  void run();
  void prepare();
  void execute_period(Nanoseconds release, Nanoseconds length);
  TraceRecord period_record(Nanoseconds release) const;

  Worker worker;
  Context context;
  RTT::base::RunnableInterface* runner = nullptr;
  Statistics statistics;
  std::thread thread;
  std::atomic<std::thread::id> id{std::thread::id()};
  // The system's number of the thread; 0 while there is none.
  std::atomic<int> number{0};
  std::atomic<bool> is_active{false}, stops{false}, is_triggered{false}, is_busy{false};
  std::atomic<Nanoseconds> period{0};
  std::atomic<std::uint64_t> cpus{0};
  // The instant of the first release; `never` as long as nobody knows it.
  std::atomic<Nanoseconds> first{never};
  std::atomic<Nanoseconds> end{never};
  // The release of the period that is executed, or else of the next one.
  std::atomic<Nanoseconds> open{never};
  bool is_held = false;
  bool is_relative = false;
  Nanoseconds deadline = 0;
  Nanoseconds overhead = 0;
  // The CPU time at the end of the period before; -1 before the first.
  Nanoseconds cpu_after_period = -1;
};

// Gives the thread its scheduler, priority and CPUs. Where it may not have them it goes on without, as with
// RTT; generated components notice it.
void PeriodicThread::State::prepare() {
  char short_name[16] = {};
  std::strncpy(short_name, worker.name.c_str(), sizeof short_name - 1);
  pthread_setname_np(pthread_self(), short_name);
  if (timeline().is_virtual()) return;
  // The thread that creates this one may have another scheduler, which threads inherit.
  sched_param parameter = {};
  parameter.sched_priority = worker.scheduling.priority;
  const int scheduler = worker.scheduling.priority > 0 ? SCHED_FIFO : SCHED_OTHER;
  if (pthread_setschedparam(pthread_self(), scheduler, &parameter) != 0 && scheduler == SCHED_FIFO) {
    RTT::log(RTT::Info) << worker.name << " may not use SCHED_FIFO, and runs with SCHED_OTHER" << RTT::endlog();
  }
  const std::uint64_t mask = cpus;
  if (mask != 0 && !set_cpus_of(pthread_self(), mask)) {
    RTT::log(RTT::Info) << worker.name << " keeps its CPUs: some of 0x" << std::hex << mask << " do not exist"
                           << RTT::endlog();
  }
  touch_stack();
}

void PeriodicThread::State::run() {
  id = std::this_thread::get_id();
  number = static_cast<int>(syscall(SYS_gettid));
  prepare();
  set_present_context(&context);
  timeline().begin(worker);
  Nanoseconds release = never;
  while (true) {
    // Whatever changes from here on changes the signal.
    const int seen = worker.signal.load(std::memory_order_acquire);
    if (stops) break;
    const Nanoseconds length = period;
    if (length == 0) {
      release = never;
    } else if (release == never) {
      release = is_held ? first.load(std::memory_order_acquire) : now() + length;
    }
    const bool is_released = length > 0 && release < end.load(std::memory_order_acquire);
    open.store(is_released ? release : never, std::memory_order_relaxed);
    const Nanoseconds begin = now();
    if (is_released && release <= begin) {
      is_triggered.exchange(false);
      execute_period(release, length);
      release = is_relative ? std::max(begin + length, now()) : release + length;
    } else if (is_triggered.exchange(false)) {
      is_busy = true;
      if (length > 0) {
        runner->serve();
      } else {
        runner->step();
      }
      is_busy = false;
    } else {
      timeline().wait(worker, seen, is_released ? release : never);
    }
  }
  if (release < end && deadline > 0 && now() - release > deadline) increment(statistics.misses);
  open = never;
  // Who has sent a call before may wait for it.
  runner->serve();
  timeline().end(worker);
  set_present_context(nullptr);
  // Another thread may get the same identifier.
  id = std::thread::id();
  is_active = false;
}

void PeriodicThread::State::execute_period(Nanoseconds release, Nanoseconds length) {
  is_busy = true;
  TraceQueue* const queue = context.queue();
  const bool is_traced = context.trace != nullptr;
  TraceRecord record = TraceRecord::of(TraceRecord::Period, context.instance.c_str(), "", 0, 0, 0);
  if (is_traced) record = period_record(release);
  const Nanoseconds cpu_before = is_traced ? cpu_time() : 0;
  const Nanoseconds began = now();
  const Nanoseconds latency = began - release;
  const bool is_real = !timeline().is_virtual();
  if (is_real) context.waits = voluntary_waits() - context.lock_waits;
  if (!is_real && overhead > 0) timeline().spend(worker, overhead);
  const bool was_running = runner->step();
  const Nanoseconds ended = now();
  const Nanoseconds response = ended - release;
  if (queue != nullptr && was_running) {
    if (is_traced) record.execution = cpu_time() - cpu_before;
    record.elapsed = ended - began;
    record.ended = ended;
    queue->push(record);
  }
  if (is_real) {
    const Nanoseconds cpu = cpu_time();
    if (was_running && cpu_after_period >= 0) {
      note_greatest(statistics.overhead, cpu - cpu_after_period - context.measured_cpu);
    }
    cpu_after_period = cpu;
    context.measured_cpu = 0;
  }
  if (was_running) {
    increment(statistics.periods);
    note_greatest(statistics.latency, latency);
    note_greatest(statistics.response, response);
    if (response > length) increment(statistics.overruns);
  }
  // Also if its task was stopped before it could begin.
  if (deadline > 0 && response > deadline) increment(statistics.misses);
  is_busy = false;
}

// Begins the record of a period. Its system calls neither wait nor allocate.
TraceRecord PeriodicThread::State::period_record(Nanoseconds release) const {
  TraceRecord record = TraceRecord::of(TraceRecord::Period, context.instance.c_str(), "", 0, 0, 0);
  record.release = release;
  if (timeline().is_virtual()) {
    record.priority = worker.scheduling.priority;
    record.cpus = static_cast<std::int64_t>(cpus.load());
    return record;
  }
  sched_param parameter = {};
  if (sched_getparam(0, &parameter) == 0) record.priority = parameter.sched_priority;
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) {
    std::uint64_t mask = 0;
    for (unsigned cpu = 0; cpu < 64; ++cpu) {
      if (CPU_ISSET(cpu, &set)) mask |= std::uint64_t(1) << cpu;
    }
    record.cpus = static_cast<std::int64_t>(mask);
  }
  record.cpu = sched_getcpu();
  return record;
}

PeriodicThread::PeriodicThread(const std::string& name, const Scheduling& scheduling)
    : state_(new State(name, scheduling)) {}

PeriodicThread::~PeriodicThread() { stop(); }

bool PeriodicThread::start(RTT::base::RunnableInterface* runner) {
  if (state_->is_active || runner == nullptr) return false;
  if (state_->thread.joinable()) state_->thread.join();
  state_->runner = runner;
  state_->stops = false;
  state_->is_triggered = false;
  state_->is_active = true;
  State* const state = state_.get();
  try {
    state_->thread = std::thread([state] { state->run(); });
  } catch (const std::exception& error) {
    state_->is_active = false;
    RTT::log(RTT::Error) << "no thread for " << state_->worker.name << ": " << error.what() << RTT::endlog();
    return false;
  }
  timeline().started(state_->worker);
  return true;
}

bool PeriodicThread::stop() {
  if (!state_->thread.joinable()) return false;
  state_->stops = true;
  timeline().wake(state_->worker);
  // In its own thread it ends with the present period, and is joined later.
  if (!is_self()) state_->thread.join();
  return true;
}

bool PeriodicThread::is_active() const { return state_->is_active && !state_->stops; }
bool PeriodicThread::is_self() const { return state_->id.load() == std::this_thread::get_id(); }

bool PeriodicThread::trigger() {
  if (!is_active()) return false;
  state_->is_triggered = true;
  timeline().wake(state_->worker);
  return true;
}

Nanoseconds PeriodicThread::period() const { return state_->period; }

void PeriodicThread::set_period(Nanoseconds period) {
  state_->period = period;
  timeline().wake(state_->worker);
}

std::uint64_t PeriodicThread::cpus() const {
  cpu_set_t set;
  // The thread of the library has this handle while it is joinable.
  if (!is_active() || timeline().is_virtual() ||
      pthread_getaffinity_np(state_->thread.native_handle(), sizeof set, &set) != 0) {
    return state_->cpus == 0 ? ~std::uint64_t(0) : state_->cpus.load();
  }
  std::uint64_t cpus = 0;
  for (unsigned cpu = 0; cpu < 64; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus |= std::uint64_t(1) << cpu;
  }
  return cpus;
}

bool PeriodicThread::set_cpus(std::uint64_t cpus) {
  const bool is_set = cpus != 0 && (timeline().is_virtual() || !is_active() ||
                                    set_cpus_of(state_->thread.native_handle(), cpus));
  if (is_set) state_->cpus = cpus;
  return is_set;
}

void PeriodicThread::hold() { state_->is_held = true; }

void PeriodicThread::release_at(Nanoseconds first) {
  state_->first.store(first, std::memory_order_release);
  timeline().wake(state_->worker);
}

void PeriodicThread::release_until(Nanoseconds end) {
  state_->end.store(end, std::memory_order_release);
  timeline().wake(state_->worker);
}

void PeriodicThread::release_after_beginnings() { state_->is_relative = true; }
void PeriodicThread::set_deadline(Nanoseconds deadline) { state_->deadline = deadline; }
void PeriodicThread::set_overhead(Nanoseconds overhead) { state_->overhead = overhead; }
const Statistics& PeriodicThread::statistics() const { return state_->statistics; }

bool PeriodicThread::has_open_period() const { return state_->open.load(std::memory_order_relaxed) <= now(); }

bool PeriodicThread::is_late() const {
  const Nanoseconds open = state_->open.load(std::memory_order_relaxed);
  return state_->deadline > 0 && open != never && now() - open > state_->deadline;
}

bool PeriodicThread::is_busy() const { return state_->is_busy; }
int PeriodicThread::number() const { return state_->number; }
const char* PeriodicThread::codel() const { return state_->context.codel.load(std::memory_order_relaxed); }
Context& PeriodicThread::context() { return state_->context; }

}  // namespace mauve
