#include "mauve/thread.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <thread>
#include <vector>

#include "context.hpp"
#include "rtt/Logger.hpp"
#include "rtt/base/PortInterface.hpp"
#include "timeline.hpp"

namespace mauve {
namespace {

// With more releases in a period, it is released less often than it might be.
constexpr std::uint64_t greatest_burst = 4096;

// What a thread may use of its stack without a page fault, once its memory is locked.
constexpr std::size_t touched_stack = 64 * 1024;

__attribute__((noinline)) void touch_stack() {
  char stack[touched_stack];
  std::memset(stack, 0, sizeof stack);
  // The compiler may not leave it out.
  asm volatile("" : : "r"(stack) : "memory");
}

cpu_set_t set_of(const Cpus& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
    if (cpus[cpu]) CPU_SET(cpu, &set);
  }
  return set;
}

Cpus cpus_in(const cpu_set_t& set) {
  Cpus cpus;
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) cpus.set(cpu, CPU_ISSET(cpu, &set) != 0);
  return cpus;
}

// The number of a set in a trace, which has 64 bits; -1 for a greater one.
std::int64_t number_of(const Cpus& cpus) {
  return (cpus >> 63).none() ? static_cast<std::int64_t>(cpus.to_ullong()) : -1;
}

// Some of a mask's CPUs may be missing: the kernel would accept the others.
bool set_cpus_of(pthread_t thread, const Cpus& cpus) {
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
  }

  void run();
  void prepare();
  State& oldest();
  void find_releases();
  void begin_period(State& released, Nanoseconds begin);
  void execute_periods(State& released, Nanoseconds release, Nanoseconds length);
  void execute_period(RTT::base::RunnableInterface& present, Nanoseconds release, Nanoseconds length);
  Nanoseconds note_overhead(bool was_running);
  void serve(bool is_step);
  void set_open();
  TraceRecord period_record(Nanoseconds release) const;
  void note_arrival(unsigned int input);
  void note_all_arrived();
  Nanoseconds release_by_data() const;
  void note_release(Nanoseconds at, Nanoseconds length);
  // The release of the oldest period that has not ended, or else of the next one; `never` if there is none before the end.
  Nanoseconds oldest_release() const {
    const State& of = releaser();
    Nanoseconds oldest = open.load(std::memory_order_relaxed);
    if (!of.ports.empty() && leader->is_active) oldest = std::min(oldest, of.release_by_data());
    return oldest < of.end ? oldest : never;
  }
  // Whose releases are those of its periods: in a list, the leader's release all.
  const State& releaser() const { return leader->is_queue ? *this : *leader; }
  Nanoseconds next_release() const { return upcoming < end.load(std::memory_order_acquire) ? upcoming : never; }

  // Whose thread executes the periods: its own one, or that of another, with the next one that this thread executes.
  State* leader = this;
  std::atomic<State*> next{nullptr};
  bool is_not_preempted = false;
  std::atomic<RTT::base::RunnableInterface*> runner{nullptr};
  Context context;
  Statistics statistics;
  std::atomic<bool> is_active{false}, is_busy{false};
  // The release of the period that is executed, or else of the next one.
  std::atomic<Nanoseconds> open{never};
  Nanoseconds deadline = 0;
  Nanoseconds overhead = 0;

  // Of a leader, whether all that its thread executes have releases of their own; and the release of the last period that has begun.
  std::atomic<bool> is_queue{false};
  std::atomic<Nanoseconds> last_release{0};
  Worker worker;
  std::thread thread;
  std::atomic<std::thread::id> id{std::thread::id()};
  // The system's number of the thread; 0 while there is none.
  std::atomic<int> number{0};
  std::atomic<bool> stops{false}, is_triggered{false};
  // The CPU time at the end of the period before, -1 before the first; and at the end of the last instance so far.
  Nanoseconds cpu_after_period = -1, cpu_after_instance = -1;

  // Of a leader, or of each in a queue.
  std::atomic<Nanoseconds> period{0};
  // The instant of the first release; `never` as long as nobody knows it.
  std::atomic<Nanoseconds> first{never};
  std::atomic<Nanoseconds> end{never};
  bool is_held = false;
  bool is_relative = false;
  // The next one; `never` as long as nobody knows it.
  Nanoseconds upcoming = never;
  // Whose data releases it; the first value since the beginning of the period before, or the one that completes all that are needed;
  // and the end of the gap.
  std::vector<const RTT::base::PortInterface*> ports;
  std::atomic<Nanoseconds> arrival{never}, earliest{0};
  // A bit for each input that a release needs data of, and those of which none has come since the beginning of the period before.
  std::uint64_t needed = 0;
  std::atomic<std::uint64_t> missing{0};
  // The last releases, as many as may be in a period.
  std::vector<Nanoseconds> releases;
  std::uint64_t release_count = 0;
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
  const Cpus& wanted = worker.scheduling.cpus;
  if (wanted.any() && !set_cpus_of(pthread_self(), wanted)) {
    RTT::log(RTT::Info) << worker.name << " keeps its CPUs: some of the wanted ones do not exist" << RTT::endlog();
  }
  touch_stack();
}

void PeriodicThread::State::run() {
  id = std::this_thread::get_id();
  number = static_cast<int>(syscall(SYS_gettid));
  prepare();
  set_present_context(&context);
  timeline().begin(worker);
  for (State* it = this; it != nullptr; it = it->next) it->upcoming = never;
  while (true) {
    // Whatever changes from here on changes the signal.
    const int seen = worker.signal.load(std::memory_order_acquire);
    if (stops) break;
    State& next_one = oldest();
    set_open();
    const Nanoseconds release = next_one.next_release(), begin = now();
    const bool is_due = release != never && release <= begin;
    // A period in a list executes the calls of all.
    if (is_triggered.exchange(false) && (is_queue || !is_due)) {
      serve(next_one.period == 0 && next_one.ports.empty() && !is_queue);
    } else if (is_due) {
      begin_period(next_one, begin);
    } else {
      timeline().wait(worker, seen, release);
    }
  }
  find_releases();
  for (State* it = this; it != nullptr; it = it->next) {
    const Nanoseconds release = it->releaser().next_release();
    if (release != never && it->deadline > 0 && now() - release > it->deadline) increment(it->statistics.misses);
    it->open.store(never, std::memory_order_relaxed);
  }
  // Who has sent a call before may wait for it.
  serve(false);
  timeline().end(worker);
  set_present_context(nullptr);
  // Another thread may get the same identifier.
  id = std::thread::id();
  is_active = false;
}

// Returns whose release is the next one. Of several at one instant, the first of the list.
PeriodicThread::State& PeriodicThread::State::oldest() {
  State *before = nullptr, *found = this;
  // One that is noted after a look at it may be older than one that is noted then: looks until it finds the same again.
  while (found != before) {
    before = found;
    find_releases();
    found = this;
    for (State* it = next; is_queue && it != nullptr; it = it->next) {
      if (it->next_release() < found->next_release()) found = it;
    }
  }
  return *found;
}

void PeriodicThread::State::find_releases() {
  for (State* it = this; it != nullptr; it = is_queue ? it->next.load() : nullptr) {
    const Nanoseconds length = it->period;
    if (!it->ports.empty()) {
      it->upcoming = it->release_by_data();
    } else if (length == 0) {
      it->upcoming = never;
    } else if (it->upcoming == never) {
      it->upcoming = it->is_held ? it->first.load(std::memory_order_acquire) : now() + length;
    }
  }
}

void PeriodicThread::State::set_open() {
  for (State* it = this; it != nullptr; it = it->next) it->open.store(it->releaser().next_release(), std::memory_order_relaxed);
}

void PeriodicThread::State::note_arrival(unsigned int input) {
  const std::uint64_t bit = needed & (std::uint64_t{1} << input);
  if ((missing.fetch_and(~bit) & ~bit) == 0) note_all_arrived();
}

void PeriodicThread::State::note_all_arrived() {
  // The word is written in any case: who takes it next then sees the value that has come.
  if (arrival.fetch_add(0) != never) return;
  Nanoseconds none = never;
  if (arrival.compare_exchange_strong(none, now())) timeline().wake(leader->worker);
}

// The next release; `never` while no value has come.
Nanoseconds PeriodicThread::State::release_by_data() const {
  const Nanoseconds came = arrival.load(std::memory_order_acquire);
  if (came == never) return never;
  const Nanoseconds begin = is_held ? first.load(std::memory_order_acquire) : 0;
  // One that is noted later than its instant comes after what has begun by then.
  return std::max({came, begin, earliest.load(std::memory_order_relaxed), leader->last_release.load(std::memory_order_relaxed)});
}

// From here on, what comes is for the next period.
void PeriodicThread::State::note_release(Nanoseconds at, Nanoseconds length) {
  missing = needed;
  arrival.exchange(never);
  // All may have come in between.
  if (needed != 0 && missing == 0) note_all_arrived();
  releases[release_count++ % releases.size()] = at;
  if (release_count >= releases.size()) earliest = releases[release_count % releases.size()] + length;
}

// Executes the calls that wait, or a step, of each that the thread executes.
void PeriodicThread::State::serve(bool is_step) {
  for (State* it = this; it != nullptr; it = it->next) {
    it->is_busy = true;
    if (RTT::base::RunnableInterface* const present = it->runner) {
      set_present_context(&it->context);
      if (is_step) {
        present->step();
      } else {
        present->serve();
      }
    }
    it->is_busy = false;
  }
}

void PeriodicThread::State::begin_period(State& released, Nanoseconds begin) {
  const Nanoseconds release = released.upcoming, length = released.period;
  if (is_queue) last_release = release;
  if (!released.ports.empty()) released.note_release(released.is_relative ? begin : release, length);
  execute_periods(released, release, length);
  released.upcoming = released.is_relative ? std::max(begin + length, now()) : release + length;
  for (unsigned int input = 0; input < released.ports.size(); ++input) {
    if (released.ports[input]->has_more()) released.note_arrival(input);
  }
}

// Of all in a list; of one in a queue, for which the thread wakes up alone.
void PeriodicThread::State::execute_periods(State& released, Nanoseconds release, Nanoseconds length) {
  for (State* it = &released; it != nullptr; it = is_queue ? nullptr : it->next.load()) {
    // From here on, who stops it waits for it.
    it->is_busy = true;
    if (RTT::base::RunnableInterface* const present = it->runner) it->execute_period(*present, release, length);
    it->open.store(never, std::memory_order_relaxed);
    it->is_busy = false;
  }
  cpu_after_period = cpu_after_instance;
  for (State* it = this; it != nullptr; it = it->next) it->context.measured_cpu = 0;
}

void PeriodicThread::State::execute_period(RTT::base::RunnableInterface& present, Nanoseconds release, Nanoseconds length) {
  set_present_context(&context);
  TraceQueue* const queue = context.queue();
  const bool is_traced = context.trace != nullptr;
  TraceRecord record = TraceRecord::of(TraceRecord::Period, context.instance.c_str(), "", 0, 0, 0);
  if (is_traced) record = period_record(release);
  if (is_not_preempted) {
    // Calls may be preempted.
    present.serve();
    timeline().set_raised(*context.worker, true);
  }
  const Nanoseconds cpu_before = is_traced ? cpu_time() : 0;
  const Nanoseconds began = now();
  const Nanoseconds latency = began - release;
  const bool is_real = !timeline().is_virtual();
  if (is_real) context.waits = voluntary_waits() - context.lock_waits;
  if (!is_real && overhead > 0) timeline().spend(*context.worker, overhead);
  const bool was_running = present.step();
  const Nanoseconds ended = now();
  const Nanoseconds response = ended - release;
  if (is_traced) record.execution = cpu_time() - cpu_before;
  if (is_real) record.overhead = note_overhead(was_running);
  if (queue != nullptr && was_running) {
    record.elapsed = ended - began;
    record.ended = ended;
    queue->push(record);
  }
  if (was_running) {
    increment(statistics.periods);
    note_greatest(statistics.latency, latency);
    note_greatest(statistics.response, response);
    if (response > length) increment(statistics.overruns);
  }
  // Also if its task was stopped before it could begin.
  if (deadline > 0 && response > deadline) increment(statistics.misses);
  if (is_not_preempted) timeline().set_raised(*context.worker, false);
}

// Returns the CPU time of the thread since the end of its period before, without codels and ports; -1 where it is unknown. Of several
// instances, the last one has that of all: the thread wakes up once for them.
Nanoseconds PeriodicThread::State::note_overhead(bool was_running) {
  const Nanoseconds cpu = cpu_time();
  // Calls of the others may have been executed in between.
  Nanoseconds measured = 0;
  for (State* it = leader; it != nullptr; it = it->next) measured += it->context.measured_cpu;
  const bool is_known = was_running && leader->cpu_after_period >= 0;
  const Nanoseconds overhead_of_period = is_known ? cpu - leader->cpu_after_period - measured : -1;
  note_greatest(statistics.overhead, overhead_of_period);
  leader->cpu_after_instance = cpu;
  return overhead_of_period;
}

// Begins the record of a period. Its system calls neither wait nor allocate.
TraceRecord PeriodicThread::State::period_record(Nanoseconds release) const {
  TraceRecord record = TraceRecord::of(TraceRecord::Period, context.instance.c_str(), "", 0, 0, 0);
  record.release = release;
  if (timeline().is_virtual()) {
    record.priority = context.worker->scheduling.priority;
    record.cpus = number_of(context.worker->scheduling.cpus);
    return record;
  }
  sched_param parameter = {};
  if (sched_getparam(0, &parameter) == 0) record.priority = parameter.sched_priority;
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) record.cpus = number_of(cpus_in(set));
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
  if (state->leader != state) return true;
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
  if (state_->leader != state_.get()) {
    if (!state_->is_active.exchange(false)) return false;
    state_->runner = nullptr;
    while (state_->is_busy && !is_self()) pause();
    return true;
  }
  if (!state_->thread.joinable()) return false;
  state_->stops = true;
  timeline().wake(state_->leader->worker);
  // In its own thread it ends with the present period, and is joined later.
  if (!is_self()) state_->thread.join();
  return true;
}

bool PeriodicThread::is_active() const { return state_->is_active && !state_->stops; }
bool PeriodicThread::is_self() const { return state_->leader->id.load() == std::this_thread::get_id(); }

bool PeriodicThread::trigger() {
  if (!is_active()) return false;
  state_->leader->is_triggered = true;
  timeline().wake(state_->leader->worker);
  return true;
}

void PeriodicThread::arrive(unsigned int input) { state_->note_arrival(input); }

bool PeriodicThread::release_by(RTT::base::PortInterface& port, std::uint64_t burst, bool needs_all) {
  const unsigned int input = static_cast<unsigned int>(state_->ports.size());
  if (input >= 64 || !port.release(this, input)) return false;
  state_->ports.push_back(&port);
  if (needs_all) state_->needed |= std::uint64_t{1} << input;
  state_->missing = state_->needed;
  state_->releases.resize(std::max<std::uint64_t>(1, std::min(burst, greatest_burst)));
  return true;
}

void PeriodicThread::run_in(PeriodicThread& other) {
  state_->leader = other.state_.get();
  state_->context.worker = &state_->leader->worker;
  State* last = state_->leader;
  while (State* const next = last->next) last = next;
  last->next = state_.get();
}

void PeriodicThread::queue_in(PeriodicThread& other) {
  other.state_->is_queue = true;
  run_in(other);
}

Nanoseconds PeriodicThread::period() const { return state_->period; }

void PeriodicThread::set_period(Nanoseconds period) {
  state_->period = period;
  timeline().wake(state_->leader->worker);
}

Cpus PeriodicThread::cpus() const {
  cpu_set_t set;
  // The thread of the library has this handle while it is joinable.
  if (!is_active() || timeline().is_virtual() ||
      pthread_getaffinity_np(state_->leader->thread.native_handle(), sizeof set, &set) != 0) {
    const Cpus& wanted = state_->worker.scheduling.cpus;
    return wanted.none() ? Cpus().set() : wanted;
  }
  return cpus_in(set);
}

bool PeriodicThread::set_cpus(const Cpus& cpus) {
  if (cpus.none()) return false;
  if (is_active()) return timeline().is_virtual() || set_cpus_of(state_->leader->thread.native_handle(), cpus);
  state_->worker.scheduling.cpus = cpus;
  return true;
}

void PeriodicThread::hold() { state_->is_held = true; }

void PeriodicThread::release_at(Nanoseconds first) {
  state_->first.store(first, std::memory_order_release);
  timeline().wake(state_->leader->worker);
}

void PeriodicThread::release_until(Nanoseconds end) {
  state_->end.store(end, std::memory_order_release);
  timeline().wake(state_->leader->worker);
}

void PeriodicThread::release_after_beginnings() { state_->is_relative = true; }
void PeriodicThread::set_not_preempted() { state_->is_not_preempted = true; }
void PeriodicThread::set_deadline(Nanoseconds deadline) { state_->deadline = deadline; }
void PeriodicThread::set_overhead(Nanoseconds overhead) { state_->overhead = overhead; }
const Statistics& PeriodicThread::statistics() const { return state_->statistics; }

bool PeriodicThread::has_open_period() const { return state_->oldest_release() <= now(); }

bool PeriodicThread::is_late() const {
  const Nanoseconds open = state_->oldest_release();
  return state_->deadline > 0 && open != never && now() - open > state_->deadline;
}

bool PeriodicThread::is_busy() const { return state_->is_busy; }
int PeriodicThread::number() const { return state_->leader->number; }
const char* PeriodicThread::codel() const { return state_->context.codel.load(std::memory_order_relaxed); }
Context& PeriodicThread::context() { return state_->context; }

}  // namespace mauve
