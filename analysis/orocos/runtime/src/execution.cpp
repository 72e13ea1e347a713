// The execution of codels and programs: measured, recorded, or given the times of the timing tables.

#include "mauve/execution.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <tuple>

#include "context.hpp"
#include "timeline.hpp"

namespace mauve {
namespace {

// A thread that waits is off the CPU for longer.
constexpr Nanoseconds least_wait = 5000;

thread_local Context* context_of_thread = nullptr;

int compare(const std::string& one, const char* other) { return std::strcmp(one.c_str(), other); }

// Lets the execution that began at `cpu_before` take this time.
void take(Context& context, Nanoseconds time, Nanoseconds cpu_before) {
  if (time < 0) return;
  if (timeline().is_virtual()) {
    timeline().spend(*context.worker, time);
    return;
  }
  const Nanoseconds left = time * context.spent_percent / 100 - (cpu_time() - cpu_before);
  if (left > 0) timeline().spend(*context.worker, left);
}

}  // namespace

Context* present_context() { return context_of_thread; }
void set_present_context(Context* context) { context_of_thread = context; }

std::int64_t voluntary_waits() {
  rusage usage = {};
  return getrusage(RUSAGE_THREAD, &usage) == 0 ? usage.ru_nvcsw : 0;
}

void Context::note(const char* name, Nanoseconds execution, Nanoseconds wait, std::int64_t wait_count, Nanoseconds waited_for_locks) {
  for (CodelStatistics& it : codels) {
    if (it.codel == nullptr) it.codel = name;
    if (it.codel != name) continue;
    it.execution = std::max(it.execution, execution);
    if (wait > 0) ++it.waits;
    it.wait = std::max(it.wait, wait);
    if (wait > 0) it.times = std::max(it.times, wait_count);
    it.blocked = std::max(it.blocked, waited_for_locks);
    return;
  }
}

void ExecutionTimes::add(Key key, Nanoseconds time) {
  const auto is_before = [](const Entry& one, const Key& other) {
    return std::tie(one.key.component, one.key.state, one.key.transition, one.key.program) <
           std::tie(other.component, other.state, other.transition, other.program);
  };
  entries_.insert(std::lower_bound(entries_.begin(), entries_.end(), key, is_before), Entry{key, time});
}

Nanoseconds ExecutionTimes::find(const char* component, const char* state, const char* transition,
                                 const char* program) const {
  const auto compare_with = [&](const Entry& entry) {
    int order = compare(entry.key.component, component);
    if (order == 0) order = compare(entry.key.state, state);
    if (order == 0) order = compare(entry.key.transition, transition);
    return order == 0 ? compare(entry.key.program, program) : order;
  };
  std::size_t begin = 0, end = entries_.size();
  while (begin < end) {
    const std::size_t middle = begin + (end - begin) / 2;
    const int found = compare_with(entries_[middle]);
    if (found == 0) return entries_[middle].time;
    if (found < 0) {
      begin = middle + 1;
    } else {
      end = middle;
    }
  }
  return -1;
}

void Context::note_port(const char* name, Nanoseconds time) {
  measured_cpu += time;
  for (PortStatistics& it : ports) {
    if (it.port == nullptr) it.port = name;
    if (it.port != name) continue;
    it.greatest = std::max(it.greatest, time);
    return;
  }
}

CodelExecution::CodelExecution(const char* codel) : context_(present_context()), codel_(codel) {
  if (context_ == nullptr) return;
  outer_ = context_->codel.load(std::memory_order_relaxed);
  context_->codel.store(codel, std::memory_order_relaxed);
  blocked_before_ = context_->blocked;
  copied_before_ = context_->copied;
  // These system calls are in no execution time.
  if (context_->trace != nullptr && !timeline().is_virtual()) waits_before_ = voluntary_waits() - context_->lock_waits;
  began_ = now();
  cpu_before_ = cpu_time();
}

CodelExecution::~CodelExecution() {
  if (context_ == nullptr) return;
  if (context_->times != nullptr && !context_->is_timed_program) {
    take(*context_, context_->times->codel(codel_), cpu_before_);
  }
  // What records its inputs is no part of it.
  const Nanoseconds execution = cpu_time() - cpu_before_ - (context_->copied - copied_before_);
  const Nanoseconds ended = now();
  // A codel in the arguments of another one is counted with it.
  if (outer_ == nullptr) context_->measured_cpu += execution;
  const Nanoseconds blocked = context_->blocked - blocked_before_;
  std::int64_t waits = -1;
  if (!timeline().is_virtual()) {
    const Nanoseconds off_cpu = ended - began_ - execution - blocked;
    // Unless executions are recorded, the system is asked only after something that may have been a wait.
    const bool is_recorded = context_->trace != nullptr;
    if (is_recorded || off_cpu > least_wait) {
      const std::int64_t before = is_recorded ? waits_before_ : context_->waits;
      context_->waits = voluntary_waits() - context_->lock_waits;
      waits = context_->waits - before;
    }
    context_->note(codel_, execution, waits > 0 ? off_cpu : 0, waits, blocked);
  }
  if (context_->queue() != nullptr) {
    TraceRecord record = TraceRecord::of(TraceRecord::Codel, context_->instance.c_str(), codel_, execution, began_, ended);
    record.waits = waits;
    record.blocked = blocked;
    record.outcome = outcome_;
    context_->queue()->push(record);
  }
  context_->codel.store(outer_, std::memory_order_relaxed);
}

PortAccess::PortAccess(const char* port, bool is_small) : context_(present_context()), port_(port) {
  if (context_ == nullptr) return;
  const bool is_recorded = context_->trace != nullptr;
  if (context_->times != nullptr && !context_->is_timed_program) time_ = context_->times->access(port);
  is_measured_ = time_ >= 0 || is_recorded || !(timeline().is_virtual() || is_small);
  if (!is_measured_ && context_->followed == nullptr) {
    context_ = nullptr;
    return;
  }
  began_ = now();
  if (is_recorded || time_ >= 0) cpu_before_ = cpu_time();
}

PortAccess::~PortAccess() {
  if (context_ == nullptr) return;
  if (time_ >= 0) take(*context_, time_, cpu_before_);
  // The clock of the CPU time needs a system call. If the thread is preempted here, the elapsed time is too much, and the overhead of
  // another period is the greatest one.
  const Nanoseconds execution = context_->trace == nullptr ? now() - began_ : cpu_time() - cpu_before_;
  if (is_measured_) context_->note_port(port_, execution);
  if (context_->queue() == nullptr) return;
  TraceRecord record = TraceRecord::of(TraceRecord::Access, context_->instance.c_str(), port_, execution, began_, now());
  record.outcome = outcome_;
  record.number = number_;
  context_->queue()->push(record);
}

ProgramExecution::ProgramExecution(const char* component, const char* state, const char* transition, const char* program)
    : context_(present_context()), component_(component), state_(state), transition_(transition), program_(program) {
  if (context_ == nullptr) return;
  if (context_->trace != nullptr) {
    began_ = now();
    cpu_before_ = cpu_time();
  }
  if (context_->times == nullptr || context_->is_timed_program) return;
  time_ = context_->times->program(component, state, transition, program);
  if (time_ < 0) return;
  context_->is_timed_program = true;
  cpu_before_ = cpu_time();
  // On a virtual clock the program itself takes no time: what it writes is written when its time has passed.
  if (timeline().is_virtual()) take(*context_, time_, cpu_before_);
}

ProgramExecution::~ProgramExecution() {
  if (context_ == nullptr) return;
  if (time_ >= 0) {
    if (!timeline().is_virtual()) take(*context_, time_, cpu_before_);
    context_->is_timed_program = false;
  }
  if (context_->queue() != nullptr) {
    const Nanoseconds execution = context_->trace == nullptr ? 0 : cpu_time() - cpu_before_;
    TraceRecord record = TraceRecord::of(TraceRecord::Program, context_->instance.c_str(), component_, execution, began_, now());
    record.state = state_;
    record.transition = transition_;
    record.program = program_;
    context_->queue()->push(record);
  }
}

}  // namespace mauve
