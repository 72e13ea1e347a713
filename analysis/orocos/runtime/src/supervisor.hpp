// Ends a robot: at its time, when it is interrupted, and when something in it does not end.

#ifndef MAUVE_SUPERVISOR_HPP
#define MAUVE_SUPERVISOR_HPP

#include <atomic>
#include <functional>
#include <string>
#include <thread>

#include "mauve/clock.hpp"

namespace mauve {

// Blocks the signals that interrupt a program, in this thread and in those that it starts. To be called first.
void block_signals();
void unblock_signals();

// A thread of higher priority than all activities, so that it ends a robot whose activities use all CPUs.
class Supervisor {
 public:
  // `on_end` is called once when the robot should end. `stuck` says what has not ended `grace` later; then the program exits.
  Supervisor(int priority, Nanoseconds grace, std::function<void()> on_end, std::function<std::string()> stuck);
  ~Supervisor();

  // From now on the robot should end at this instant of the real clock.
  void end_at(Nanoseconds instant) { end_ = instant; }
  bool should_end() const { return should_end_; }
  bool is_interrupted() const { return is_interrupted_; }

 private:
  void run(int priority, Nanoseconds grace);

  const std::function<void()> on_end_;
  const std::function<std::string()> stuck_;
  std::atomic<Nanoseconds> end_{never};
  std::atomic<bool> should_end_{false}, is_interrupted_{false}, is_finished_{false};
  std::thread thread_;
};

}  // namespace mauve

#endif
