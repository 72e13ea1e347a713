#ifndef MAUVE_RTT_EXECUTION_ENGINE_HPP
#define MAUVE_RTT_EXECUTION_ENGINE_HPP

#include <atomic>

#include "rtt/base/ActivityInterface.hpp"
#include "rtt/base/RunnableInterface.hpp"

namespace RTT {

class ExecutionEngine;
class TaskContext;

namespace base {
class TaskCore;
}

namespace internal {

// A call that waits for the thread of an engine.
class Message {
 public:
  virtual ~Message() {}
  virtual void execute() = 0;
  // The engine has ended without executing it.
  virtual void abandon() = 0;

 private:
  friend class RTT::ExecutionEngine;

  Message* next_ = nullptr;
};

// Waits until the value of an atomic changes, without a lock: a futex.
struct Waiting {
  // Returns when the value is another one, and perhaps before.
  static void wait(const std::atomic<int>& value, int present);
  // To be called after a change.
  static void notify(const std::atomic<int>& value);
};

}  // namespace internal

// What runs a task: in each step first the operations that others asked for, then the hook of the task's state.
class ExecutionEngine : public base::RunnableInterface {
 public:
  explicit ExecutionEngine(base::TaskCore* task) : task_(task) {}
  ExecutionEngine(const ExecutionEngine&) = delete;
  ExecutionEngine& operator=(const ExecutionEngine&) = delete;

  bool step() override;
  void serve() override;

  // Does the calling thread run it?
  bool is_self() const { return activity_ != nullptr && activity_->isSelf(); }

  // Passes a call to the thread that runs it, in the order of the calls: never waits, locks or allocates. False if there is none.
  bool process(internal::Message& message);

  // An operation of the task has thrown: to be called in the handler of the exception.
  void failed();

 private:
  friend class base::TaskCore;
  friend class TaskContext;

  void execute_messages();
  // Takes all calls that wait, the first one first.
  internal::Message* take_messages();
  void abandon_messages();

  base::TaskCore* const task_;
  base::ActivityInterface* activity_ = nullptr;
  // A list, the last call first.
  std::atomic<internal::Message*> messages_{nullptr};
};

}  // namespace RTT

#endif
