// How the threads of activities wait, wake and spend time: on the computer's clock or on a virtual one.

#ifndef MAUVE_TIMELINE_HPP
#define MAUVE_TIMELINE_HPP

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <string>

#include "mauve/thread.hpp"

namespace mauve {

// The thread of an activity.
struct Worker {
  std::string name;
  Scheduling scheduling;
  // Changes whenever somebody wakes the thread.
  std::atomic<int> signal{0};

  // Of the virtual clock: see virtual_clock.cpp.
  struct {
    std::condition_variable turn;
    enum { Absent, Waiting, Ready } state = Absent;
    Nanoseconds until = never;
    Nanoseconds remaining = 0;
    Nanoseconds executed = 0;
    // Where it executes, or executed last; -1 before.
    int cpu = -1;
    bool is_on_cpu = false;
    std::uint64_t ready_since = 0;
    bool is_raised = false;
    // Whether the releases at this instant come before it goes on.
    bool yields = false;
  } simulated;
};

// Of SCHED_FIFO.
constexpr int highest_priority = 99;

class Timeline {
 public:
  virtual ~Timeline() {}
  virtual bool is_virtual() const = 0;
  virtual Nanoseconds now() const = 0;
  // In the thread of the activity: before everything else, and at last.
  virtual void begin(Worker& worker) = 0;
  virtual void end(Worker& worker) = 0;
  // In the thread of the activity: waits until `until`, or until its signal differs from `seen`.
  virtual void wait(Worker& worker, int seen, Nanoseconds until) = 0;
  // In the thread of the activity: executes for this time.
  virtual void spend(Worker& worker, Nanoseconds time) = 0;
  // In the thread of the activity: from now on it has the highest priority, or its own one.
  virtual void set_raised(Worker& worker, bool is_raised) = 0;
  // In any thread.
  virtual void wake(Worker& worker) = 0;
  // In the thread that has started the activity, which then waits until `begin` is called.
  virtual void started(Worker& worker) = 0;
};

// The computer's monotonic clock, whatever the timeline is.
Nanoseconds real_now();

Timeline& timeline();
// Before any activity is started.
void set_timeline(Timeline& timeline);

}  // namespace mauve

#endif
