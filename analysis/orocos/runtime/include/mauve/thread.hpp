#ifndef MAUVE_THREAD_HPP
#define MAUVE_THREAD_HPP

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "mauve/clock.hpp"
#include "mauve/cpus.hpp"
#include "rtt/base/RunnableInterface.hpp"

namespace RTT {
namespace base {
class PortInterface;
}
}  // namespace RTT

namespace mauve {

struct Context;

// What a thread wants of the scheduler.
struct Scheduling {
  // 1 to 99 for SCHED_FIFO; 0 for SCHED_OTHER.
  int priority;
  // 0 for a thread that is triggered only.
  Nanoseconds period;
  // None: any.
  Cpus cpus;
};

// What the periods of a thread were like. Its thread writes, all threads may read.
struct Statistics {
  std::atomic<std::uint64_t> periods{0};
  // The periods that did not end at their deadline or before.
  std::atomic<std::uint64_t> misses{0};
  // The periods that ended after the next release.
  std::atomic<std::uint64_t> overruns{0};
  // The greatest times from a release to the end of its period, and to its beginning.
  std::atomic<Nanoseconds> response{0};
  std::atomic<Nanoseconds> latency{0};
  // The greatest CPU time from the end of a period to the end of the next, without that of codels, and of ports
  // where that is measured.
  std::atomic<Nanoseconds> overhead{0};
};

// A thread that executes a period at each release, and in between the calls that wait for it. A late period moves no release:
// missed periods are caught up one by one. In between, the thread neither locks nor allocates. The clock releases it, or data.
class PeriodicThread {
 public:
  PeriodicThread(const std::string& name, const Scheduling& scheduling);
  ~PeriodicThread();
  PeriodicThread(const PeriodicThread&) = delete;
  PeriodicThread& operator=(const PeriodicThread&) = delete;

  bool start(RTT::base::RunnableInterface* runner);
  // Waits until the present period has ended, and then until the thread has.
  bool stop();
  bool is_active() const;
  bool is_self() const;
  // Executes the calls that wait; without a period, one period.
  bool trigger();

  Nanoseconds period() const;
  void set_period(Nanoseconds period);
  Cpus cpus() const;
  bool set_cpus(const Cpus& cpus);

  // Before `start`: the first release is not one period after the start, but comes with `release_at`.
  void hold();
  void release_at(Nanoseconds first);
  // Nothing is released at this instant or later.
  void release_until(Nanoseconds end);
  // Before `start`: each release is one period after the beginning of the period before, if that has ended.
  void release_after_beginnings();
  // Before `start`: executes its periods in the thread of `other`, after those of all that do so already. `other` decides on the
  // scheduling and the releases, and is stopped before this one is destroyed.
  void run_in(PeriodicThread& other);
  // The same, but each that the thread executes has its own releases, by the clock or by data, and the thread executes periods in the
  // order of their releases: a queue. Of several releases at one instant, that of `other` comes first, then those added before. All that
  // releases this one is set before.
  void queue_in(PeriodicThread& other);
  // Before `start`: a period that has begun has the highest priority until its end.
  void set_not_preempted();
  // Before `start`: values that come to this input release it, at most `burst` times in a period. False if the port is no input. Called
  // for several inputs, values at one of them release it, or at all.
  //
  // It is released when a value has come since the beginning of the period before, or a buffer of the port is not empty at the end of
  // that period; and not before the end of a gap: one period after the release that was the last but `burst`. What comes in a gap releases
  // it at its end.
  bool release_by(RTT::base::PortInterface& port, std::uint64_t burst, bool needs_all);
  // In any thread: a value has come to the input of this number. Never waits, locks or allocates.
  void arrive(unsigned int input);
  // Before `start`: the deadline, for the statistics.
  void set_deadline(Nanoseconds deadline);
  // Before `start`: the execution time that a period takes on a virtual clock in addition to its codels.
  void set_overhead(Nanoseconds overhead);

  const Statistics& statistics() const;
  // Whether a period has been released that has not ended.
  bool has_open_period() const;
  // Whether a period has not ended whose deadline has passed: the statistics do not count it yet.
  bool is_late() const;
  // Whether a period or a call is being executed, and the codel that is, if one is.
  bool is_busy() const;
  const char* codel() const;
  // The system's number of the thread; 0 before it has begun.
  int number() const;

  // For the library alone.
  Context& context();

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace mauve

#endif
