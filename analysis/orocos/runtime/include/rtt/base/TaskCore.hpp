#ifndef MAUVE_RTT_TASK_CORE_HPP
#define MAUVE_RTT_TASK_CORE_HPP

#include <atomic>

#include "rtt/ExecutionEngine.hpp"
#include "rtt/base/ActivityInterface.hpp"

namespace RTT {
namespace base {

// The states of a task. The thread of its activity executes `updateHook` and `errorHook`; whoever calls `configure`, `start`,
// `stop` and `cleanup`, one at a time, executes their hooks. `stop` waits until the thread is between two periods.
class TaskCore {
 public:
  enum TaskState { Init, PreOperational, FatalError, Exception, Stopped, Running, RunTimeError };

  virtual ~TaskCore() {}
  TaskCore(const TaskCore&) = delete;
  TaskCore& operator=(const TaskCore&) = delete;

  virtual bool configure();
  virtual bool start();
  virtual bool stop();
  virtual bool cleanup();
  virtual bool activate() { return engine_.activity_ != nullptr && engine_.activity_->start(); }
  virtual bool recover();
  virtual void error();

  virtual bool update() { return engine_.activity_ != nullptr && engine_.activity_->execute(); }
  virtual bool trigger() { return engine_.activity_ != nullptr && engine_.activity_->trigger(); }

  virtual TaskState getTaskState() const { return state_; }
  // Where it is on its way to.
  virtual TaskState getTargetState() const { return target_; }
  virtual bool isConfigured() const { return state_ >= Stopped; }
  virtual bool isRunning() const { return state_ >= Running; }
  virtual bool inException() const { return state_ == Exception; }

  virtual Seconds getPeriod() const {
    return engine_.activity_ == nullptr ? -1.0 : engine_.activity_->getPeriod();
  }
  virtual bool setPeriod(Seconds period) {
    return engine_.activity_ != nullptr && engine_.activity_->setPeriod(period);
  }
  virtual unsigned getCpuAffinity() const {
    return engine_.activity_ == nullptr ? ~0u : engine_.activity_->getCpuAffinity();
  }
  virtual bool setCpuAffinity(unsigned mask) {
    return engine_.activity_ != nullptr && engine_.activity_->setCpuAffinity(mask);
  }

  ExecutionEngine* engine() { return &engine_; }

  // Not in RTT: whether a hook has thrown, also if the task has left the exception state since then.
  bool hasThrown() const { return has_thrown_; }

 protected:
  explicit TaskCore(TaskState initial_state)
      : engine_(this), initial_state_(initial_state), state_(initial_state), target_(initial_state) {}

  virtual bool configureHook() { return true; }
  virtual bool startHook() { return true; }
  virtual void updateHook() {}
  virtual void stopHook() {}
  virtual void cleanupHook() {}
  virtual void errorHook() {}
  virtual void exceptionHook() {}

  // A hook or an operation has thrown.
  virtual void exception();

  void set_engine_activity(ActivityInterface* activity) { engine_.activity_ = activity; }

 private:
  friend class RTT::ExecutionEngine;

  // Executes a change of the state. If a hook throws, the task enters `Exception`.
  template <class F>
  bool guarded(const char* where, F f);

  // A hook may not change the state and succeed.
  bool changed_in(const char* where);

  void enter(TaskState state) {
    target_ = state;
    state_ = state;
  }

  // In the thread of the activity. Returns whether the task was running.
  bool step();

  ExecutionEngine engine_;
  const TaskState initial_state_;
  std::atomic<TaskState> state_;
  std::atomic<TaskState> target_;
  // Whether the thread executes a period or a call.
  std::atomic<bool> is_busy_{false};
  std::atomic<bool> has_thrown_{false};
};

}  // namespace base
}  // namespace RTT

#endif
