// {generated}
//
// The base class of all components of this package.

#pragma once

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <limits>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <rtt/FlowStatus.hpp>
#include <rtt/Logger.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/SendHandle.hpp>
#include <rtt/SendStatus.hpp>
#include <rtt/TaskContext.hpp>
#include <rtt/base/PortInterface.hpp>

#ifdef MAUVE_RUNTIME
#include <mauve/clock.hpp>
#else
#include <rtt/base/ActivityInterface.hpp>
#include <rtt/base/InputPortInterface.hpp>
#include <rtt/os/ThreadInterface.hpp>
#endif

namespace {lib} {

class MauveTask : public RTT::TaskContext {
 public:
  explicit MauveTask(const std::string& name) : RTT::TaskContext(name, PreOperational), period_(2) {
    addOperation("mauve_runs_as", &MauveTask::mauve_runs_as, this, RTT::OwnThread)
        .doc("Checks the scheduling of the component's thread. If it differs, the component does not start.")
        .arg("priority", "the expected SCHED_FIFO priority; 0 for SCHED_OTHER")
        .arg("cpus", "the expected CPUs, one bit for each; 0 for any");
    addOperation("mauve_runs_on", &MauveTask::mauve_runs_on, this, RTT::OwnThread)
        .doc("Restricts the component's thread to these CPUs. Orocos knows only the first 32.")
        .arg("cpus", "their numbers, from 0 on: 40, 41");
    addOperation("mauve_has_buffer", &MauveTask::mauve_has_buffer, this, RTT::ClientThread)
        .doc("The connection of this input has a buffer, which the component clears when it starts.")
        .arg("port", "the name of an input");
    addOperation("mauve_released_by", &MauveTask::mauve_released_by, this, RTT::ClientThread)
        .doc("Data at this input releases the component. To be called for each such input, before it is connected.")
        .arg("port", "the name of an input")
        .arg("least", "the gap between releases, in seconds")
        .arg("burst", "the number of releases in that time")
        .arg("needs_all", "whether a release needs data at all of these inputs, and not only at one");
    addOperation("mauve_is_not_preempted", &MauveTask::mauve_is_not_preempted, this, RTT::ClientThread)
        .doc("A period of the component that has begun has the highest priority until its end.");
    addOperation("mauve_executes", &MauveTask::mauve_executes, this, RTT::ClientThread)
        .doc("The component's thread executes each period of a peer before its own: a slave activity.")
        .arg("peer", "the name of the peer");
  }

  // Executed by the component's own thread.
  bool mauve_runs_as(int priority, unsigned int cpus) {
    is_known_ = true;
    priority_ = priority;
    cpus_ = cpus;
    mauve_raise(true);
    is_scheduled_ = mauve_is_scheduled();
    mauve_raise(false);
#ifndef MAUVE_RUNTIME
    // Late periods are caught up, as many as there are: Orocos would end the thread after some.
    if (getActivity() != nullptr && getActivity()->thread() != nullptr) getActivity()->thread()->setMaxOverrun(-1);
#endif
    return is_scheduled_;
  }

  // Executed by the component's own thread. `mauve_runs_as` checks it.
  bool mauve_runs_on(const std::string& cpus) {
    CPU_ZERO(&only_);
    std::istringstream in(cpus);
    for (unsigned int cpu = 0; in >> cpu && cpu < CPU_SETSIZE; in.ignore()) CPU_SET(cpu, &only_);
    has_only_ = true;
    return pthread_setaffinity_np(pthread_self(), sizeof only_, &only_) == 0;
  }

  // Executed by the deployer's thread, before the component starts.
  bool mauve_has_buffer(const std::string& port) {
    if (getPort(port) == nullptr) return false;
    buffered_.push_back(port);
    return true;
  }

  // Executed by the deployer's thread, before the input is connected. Without Orocos, MAUVE's own runtime
  // releases the component.
  bool mauve_released_by(const std::string& port, double least, unsigned int burst, bool needs_all) {
    RTT::base::PortInterface* const trigger = getPort(port);
    triggers_.push_back({trigger, 0, false});
    least_ = least;
    needs_all_ = needs_all;
    releases_.assign(burst == 0 ? 1 : burst, 0.0);
#ifndef MAUVE_RUNTIME
    auto* const input = dynamic_cast<RTT::base::InputPortInterface*>(trigger);
    if (input == nullptr) return false;
    // A port is added once.
    ports()->removePort(port);
    const std::size_t index = triggers_.size() - 1;
    ports()->addEventPort(*input, [this, index](RTT::base::PortInterface*) {
      ++triggers_[index].unread;
      mauve_release(triggers_[index]);
    });
#endif
    return trigger != nullptr;
  }

  // Executed by the deployer's thread, before `mauve_runs_as`. Without Orocos, MAUVE's own runtime raises the priority of each
  // period.
  bool mauve_is_not_preempted() {
    is_not_preempted_ = true;
    return true;
  }

  // Executed by the deployer's thread, before the component starts.
  bool mauve_executes(const std::string& peer) {
    RTT::TaskContext* const mate = getPeer(peer);
    if (mate != nullptr) mates_.push_back(mate);
    return mate != nullptr;
  }

 protected:
  // A call of an operation by another component. It is refused while this component is not running:
  // the caller gets `failure`. During the call, the deployer's thread executes no hook.
  class MauveCall {
   public:
    explicit MauveCall(MauveTask& task) : task_(task) {
      Gate expected = Open;
      const bool refuses = !task.isRunning() || !task.gate_.compare_exchange_strong(expected, Busy);
      task.refuses_in_ = refuses ? std::this_thread::get_id() : std::thread::id();
      if (refuses) throw Refusal();
      task.executes_in_ = std::this_thread::get_id();
    }
    ~MauveCall() { task_.gate_ = Open; }
    MauveCall(const MauveCall&) = delete;
    MauveCall& operator=(const MauveCall&) = delete;

   private:
    MauveTask& task_;
  };

  // Called by the constructor: adds a port that publishes each change of the machine's state, and
  // reserves space for names of this length.
  void mauve_add_state_port(const char* name, std::size_t longest) {
    state_.assign(longest, ' ');
    state_port_.setDataSample(state_);
    addPort(name, state_port_).doc("The state of the machine, written when it changes.");
  }

  // Called by the constructor: adds a port that publishes the CPU time of each period.
  void mauve_add_period_port(const char* name) {
    has_period_port_ = true;
    period_port_.setDataSample(period_);
    addPort(name, period_port_)
        .doc("CPU time of the period in s; number of periods so far that ended after the next release.");
  }

  // `name` must stay valid: the pointer is kept.
  void mauve_show_state(const char* name) {
    if (name == shown_) return;
    shown_ = name;
    state_.assign(name);
    state_port_.write(state_);
  }

  // Called at the end of `startHook`.
  void mauve_started() {
    is_first_period_ = true;
    overruns_ = 0;
    // What came before is no event: Orocos calls `updateHook` once at the start.
    is_waiting_ = !triggers_.empty();
    next_ = 0;
    gate_ = Open;
  }

  // Called at the beginning of `stopHook`: waits until a running call has ended.
  void mauve_stopping() {
    Gate expected = Open;
    while (!gate_.compare_exchange_weak(expected, Closed) && expected != Closed) {
      expected = Open;
      const timespec moment = {0, 100000};
      nanosleep(&moment, nullptr);
    }
  }

  // Called at the beginning of `startHook`.
  bool mauve_may_start() {
    if (is_known_ && !is_scheduled_) {
      RTT::log(RTT::Error) << getName() << " does not start: it is not scheduled as analysed"
                           << RTT::endlog();
      return false;
    }
    return true;
  }

  // Whether an input has a buffer. One that filled before its reader starts would stay full at equal
  // rates, and its oldest value would be read for ever. An input without a buffer keeps its value.
  bool mauve_is_buffered(const std::string& port) const {
    return std::find(buffered_.begin(), buffered_.end(), port) != buffered_.end();
  }

  // Called at the beginning of a period. Returns false if the component is not released; and in the first
  // period if the thread is not scheduled as analysed: then it enters its exception state.
  bool mauve_begin() {
    for (RTT::TaskContext* mate : mates_) mate->update();
    // This load makes the writes of `startHook`, in another thread, visible.
    if (gate_.load() == Closed) return false;
    refuses_in_ = std::thread::id();
    executes_in_ = std::this_thread::get_id();
#ifndef MAUVE_RUNTIME
    if (!triggers_.empty() && !mauve_is_released()) return false;
    mauve_raise(true);
#endif
    if (is_first_period_ && is_known_ && !mauve_is_scheduled()) {
      exception();
      return false;
    }
    if (has_period_port_) {
      begin_ = mauve_now(CLOCK_THREAD_CPUTIME_ID);
      // A late start does not move the next release. A background activity and one that data releases
      // have no fixed releases: the next period is counted from this one.
      const double now = mauve_now(CLOCK_MONOTONIC);
      const bool is_new = is_first_period_ || !triggers_.empty() || (is_known_ && priority_ == 0);
      release_ = is_new ? now : std::min(release_ + getPeriod(), now);
    }
    is_first_period_ = false;
    return true;
  }

  // Called at the end of a period.
  void mauve_end() {
#ifndef MAUVE_RUNTIME
    for (Trigger& it : triggers_) {
      if (it.unread > 0 && mauve_is_buffered(it.port->getName())) mauve_release(it);
    }
#endif
    if (has_period_port_) {
      const double period = triggers_.empty() ? getPeriod() : least_;
      if (period > 0 && mauve_now(CLOCK_MONOTONIC) > release_ + period) ++overruns_;
      period_[0] = mauve_now(CLOCK_THREAD_CPUTIME_ID) - begin_;
      period_[1] = overruns_;
      period_port_.write(period_);
    }
#ifndef MAUVE_RUNTIME
    mauve_raise(false);
#endif
  }

  // Returns the status of a read, by which the component knows whether a buffer has more.
  RTT::FlowStatus mauve_read(const RTT::base::PortInterface& port, RTT::FlowStatus status) {
    for (Trigger& it : triggers_) {
      if (&port == it.port) it.unread = status == RTT::NewData && it.unread > 0 ? it.unread - 1 : 0;
    }
    return status;
  }

  // Sends a call. A call that cannot be sent has failed.
  template <class Signature, class... Arguments>
  static RTT::SendHandle<Signature> mauve_send(RTT::OperationCaller<Signature>& operation,
                                               Arguments&&... arguments) {
    try {
      return operation.send(std::forward<Arguments>(arguments)...);
    } catch (const std::exception& thrown) {
      RTT::log(RTT::Error) << operation.getName() << ": " << thrown.what() << RTT::endlog();
      return RTT::SendHandle<Signature>();
    }
  }

  // Collects a call. A call whose operation throws has failed. RTT would throw again at each collect,
  // so the handle is replaced by an empty one, which reports failure without throwing.
  template <class Handle, class... Results>
  static RTT::SendStatus mauve_collect(Handle& handle, Results&... results) {
    try {
      return handle.collectIfDone(results...);
    } catch (const std::exception&) {
      handle = Handle();
      return RTT::SendFailure;
    }
  }

  // Returns true the first time only: later, another component may be reading the connections
  // during `configureHook`.
  bool mauve_makes_room() {
    const bool is_first = !has_room_;
    has_room_ = true;
    return is_first;
  }

  // Parses a whole number. Leaves the value unchanged if the text is not a number of this type.
  template <class Number>
  static bool mauve_parse(const std::string& text, Number& value) {
    std::istringstream in(text);
    const bool is_negative = !text.empty() && text[0] == '-';
    long long below = 0;
    unsigned long long above = 0;
    if (!(is_negative ? in >> below : in >> above) || !in.eof()) return false;
    typedef std::numeric_limits<Number> Limits;
    if (is_negative) {
      if (below < static_cast<long long>(Limits::min())) return false;
      value = static_cast<Number>(below);
    } else {
      if (above > static_cast<unsigned long long>(Limits::max())) return false;
      value = static_cast<Number>(above);
    }
    return true;
  }

  // RTT calls this when an operation of the component throws. A refused call is not an error of
  // this component; and while the deployer stops it, the deployer executes the same hooks.
  void exception() override {
    const std::thread::id self = std::this_thread::get_id();
#ifndef MAUVE_RUNTIME
    if (executes_in_.load() == self) mauve_raise(false);
#endif
    if (refuses_in_.load() == self) {
      refuses_in_ = std::thread::id();
      return;
    }
    if (executes_in_.load() == self && isRunning() && getTargetState() == Stopped) return;
    gate_ = Closed;
    RTT::TaskContext::exception();
  }

 private:
  enum Gate { Closed, Open, Busy };

  enum { highest_priority = 99 };

  struct Refusal : std::exception {
    const char* what() const noexcept override { return "the component is not running: it refuses the call"; }
  };

  // An input whose data releases the component; the values that may not have been read, and whether one has come since
  // the beginning of the last period.
  struct Trigger {
    RTT::base::PortInterface* port;
    std::size_t unread;
    bool has_come;
  };

#ifndef MAUVE_RUNTIME
  // In the component's thread, for new data: the next period begins now, or at the end of the gap. The thread has no period
  // of its own; one that is as long as the rest of the gap is its timer.
  void mauve_release(Trigger& trigger) {
    trigger.has_come = true;
    const auto has_come = [](const Trigger& it) { return it.has_come; };
    if (needs_all_ && !std::all_of(triggers_.begin(), triggers_.end(), has_come)) return;
    if (is_waiting_) return;
    is_waiting_ = true;
    next_ = std::max(mauve_now(CLOCK_MONOTONIC), earliest_);
    mauve_wait();
  }

  void mauve_wait() {
    const double left = next_ - mauve_now(CLOCK_MONOTONIC);
    setPeriod(std::max(left, 0.0));
    if (left <= 0) trigger();
  }

  // Whether a period begins. Orocos also calls `updateHook` when the timer has done its work.
  bool mauve_is_released() {
    if (getPeriod() > 0) setPeriod(0);
    if (is_waiting_ && next_ > mauve_now(CLOCK_MONOTONIC)) mauve_wait();
    if (!is_waiting_ || next_ > mauve_now(CLOCK_MONOTONIC)) return false;
    is_waiting_ = false;
    for (Trigger& it : triggers_) it.has_come = false;
    // From the release that is `burst` before the next one.
    releases_[count_++ % releases_.size()] = next_ > 0 ? next_ : mauve_now(CLOCK_MONOTONIC);
    const double last = releases_[count_ % releases_.size()];
    earliest_ = last > 0 ? last + least_ : 0;
    return true;
  }
#endif

  static double mauve_now(clockid_t clock) {
#ifdef MAUVE_RUNTIME
    // The clock of this runtime may be a virtual one.
    return 1e-9 * static_cast<double>(clock == CLOCK_MONOTONIC ? ::mauve::now() : ::mauve::cpu_time());
#else
    timespec now = {};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
#endif
  }

  // In the component's thread: from now on it has the priority of a period that has begun, or its own one. `mauve_is_scheduled` checks it.
  void mauve_raise(bool is_raised) {
    if (!is_not_preempted_ || priority_ == 0) return;
    pthread_setschedprio(pthread_self(), is_raised ? highest_priority : priority_);
  }

  // Logs the differences from the analysed scheduling. MAUVE_ALLOW_NON_REALTIME=true accepts them.
  bool mauve_is_scheduled() const {
    const std::string difference = mauve_difference();
    if (difference.empty()) return true;
    const char* const allowed = std::getenv("MAUVE_ALLOW_NON_REALTIME");
    const bool is_allowed = allowed != nullptr && std::string(allowed) == "true";
    RTT::log(is_allowed ? RTT::Warning : RTT::Error)
        << getName() << " is not scheduled as analysed: " << difference
        << (is_allowed ? ". The response times do not hold (MAUVE_ALLOW_NON_REALTIME)" : "") << RTT::endlog();
    return is_allowed;
  }

  std::string mauve_difference() const {
    // Asks the kernel: pthread_getschedparam only returns what was set before.
    sched_param has = {};
    const int said = sched_getscheduler(0);
    if (said < 0 || sched_getparam(0, &has) != 0) return "the scheduler of its thread is unknown";
    const int policy = said & ~SCHED_RESET_ON_FORK;
    const int expected = is_not_preempted_ ? highest_priority : priority_;
    std::ostringstream out;
    if (priority_ == 0 && policy != SCHED_OTHER) {
      out << "it runs with a real-time scheduler, but is analysed as a background activity; ";
    } else if (priority_ > 0 && policy != SCHED_FIFO) {
      out << "its scheduler is not SCHED_FIFO (is the user permitted to use it? `ulimit -r` shows "
          << "the highest permitted priority, and " << expected << " is needed); ";
    } else if (priority_ > 0 && has.sched_priority != expected) {
      out << "its priority is " << has.sched_priority << " instead of " << expected << "; ";
    }
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    unsigned int may = 0;
    bool has_others = pthread_getaffinity_np(pthread_self(), sizeof cpus, &cpus) != 0;
    for (unsigned int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &cpus)) continue;
      if (cpu < 32) {
        may |= 1u << cpu;
      } else {
        has_others = true;
      }
    }
    if (has_only_ && !CPU_EQUAL(&cpus, &only_)) out << "it may not run on its CPUs only (do they exist?); ";
    if (cpus_ != 0 && (may != cpus_ || has_others)) {
      out << "its CPU affinity is 0x" << std::hex << may << " instead of 0x" << cpus_
          << " (do these CPUs exist?); ";
    }
    const std::string text = out.str();
    return text.empty() ? text : text.substr(0, text.size() - 2);
  }

  std::atomic<Gate> gate_{Closed};
  // The thread that last refused a call, and the thread that executes periods and calls.
  std::atomic<std::thread::id> refuses_in_{std::thread::id()};
  std::atomic<std::thread::id> executes_in_{std::thread::id()};
  bool has_room_ = false;
  std::vector<std::string> buffered_;
  // The peers whose periods the component's thread executes before its own.
  std::vector<RTT::TaskContext*> mates_;
  // The inputs whose data releases the component, the gap in seconds, and its last releases.
  std::vector<Trigger> triggers_;
  bool needs_all_ = false;
  double least_ = 0;
  std::vector<double> releases_;
#ifndef MAUVE_RUNTIME
  std::size_t count_ = 0;
  // The end of the gap.
  double earliest_ = 0;
#endif
  // Whether a release is to come, and when.
  bool is_waiting_ = false;
  double next_ = 0;
  // The scheduling that was analysed; unknown until `mauve_runs_as` is called.
  bool is_known_ = false;
  bool is_scheduled_ = false;
  int priority_ = 0;
  // Whether a period that has begun has the highest priority.
  bool is_not_preempted_ = false;
  unsigned int cpus_ = 0;
  // The CPUs of `mauve_runs_on`, if it was called.
  cpu_set_t only_ = {};
  bool has_only_ = false;
  bool is_first_period_ = false;
  double begin_ = 0;
  double release_ = 0;
  double overruns_ = 0;
  bool has_period_port_ = false;
  std::vector<double> period_;
  RTT::OutputPort<std::vector<double>> period_port_;
  const char* shown_ = nullptr;
  std::string state_;
  RTT::OutputPort<std::string> state_port_;
};

}  // namespace {lib}
