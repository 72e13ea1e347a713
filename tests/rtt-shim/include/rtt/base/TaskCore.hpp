#ifndef RTT_SHIM_TASK_CORE_HPP
#define RTT_SHIM_TASK_CORE_HPP

#include <atomic>
#include <exception>
#include <mutex>

#include "rtt/ExecutionEngine.hpp"
#include "rtt/Logger.hpp"
#include "rtt/base/ActivityInterface.hpp"

namespace RTT {
namespace base {

class TaskCore {
 public:
  enum TaskState { Init, PreOperational, FatalError, Exception, Stopped, Running, RunTimeError };

  virtual ~TaskCore() {}
  TaskCore(const TaskCore&) = delete;
  TaskCore& operator=(const TaskCore&) = delete;

  virtual bool configure() {
    return transition("configure", [this] {
      if (state_ != Stopped && state_ != PreOperational) return false;
      const bool configured = configureHook();
      state_ = configured ? Stopped : PreOperational;
      return configured;
    });
  }

  virtual bool start() {
    return transition("start", [this] {
      if (state_ != Stopped || !startHook()) return false;
      state_ = Running;
      trigger();
      return true;
    });
  }

  virtual bool stop() {
    return transition("stop", [this] {
      if (state_ < Running) return false;
      stopHook();
      state_ = Stopped;
      return true;
    });
  }

  virtual bool cleanup() {
    return transition("cleanup", [this] {
      if (state_ != Stopped) return false;
      cleanupHook();
      state_ = PreOperational;
      return true;
    });
  }

  virtual bool activate() { return engine_.activity_ != nullptr && engine_.activity_->start(); }

  virtual bool recover() {
    const std::lock_guard<std::recursive_mutex> lock(engine_.running_);
    if (state_ == Exception) {
      state_ = initial_state_;
    } else if (state_ == RunTimeError) {
      state_ = Running;
    } else {
      return false;
    }
    return true;
  }

  virtual void error() {
    const std::lock_guard<std::recursive_mutex> lock(engine_.running_);
    if (state_ >= Running) state_ = RunTimeError;
  }

  virtual bool update() { return engine_.activity_ != nullptr && engine_.activity_->execute(); }
  virtual bool trigger() { return engine_.activity_ != nullptr && engine_.activity_->trigger(); }

  virtual TaskState getTaskState() const { return state_; }
  // Where it is on its way to. Here nothing is seen on its way.
  virtual TaskState getTargetState() const { return state_; }
  virtual bool isConfigured() const { return state_ >= Stopped; }
  virtual bool isRunning() const { return state_ >= Running; }
  virtual bool inException() const { return state_ == Exception; }

  virtual Seconds getPeriod() const {
    return engine_.activity_ == nullptr ? 0.0 : engine_.activity_->getPeriod();
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

 protected:
  explicit TaskCore(TaskState initial_state)
      : engine_(this), initial_state_(initial_state), state_(initial_state) {}

  virtual bool configureHook() { return true; }
  virtual bool startHook() { return true; }
  virtual void updateHook() {}
  virtual void stopHook() {}
  virtual void cleanupHook() {}
  virtual void errorHook() {}
  virtual void exceptionHook() {}

  // What throws, and operations are no exception, ends here.
  virtual void exception() { to_exception(); }

  void set_engine_activity(ActivityInterface* activity) { engine_.activity_ = activity; }

 private:
  friend class RTT::ExecutionEngine;
  friend class RTT::internal::Engines;

  // A hook that throws brings its task into `Exception`.
  template <class F>
  bool transition(const char* where, F f) {
    const std::lock_guard<std::recursive_mutex> lock(engine_.running_);
    try {
      return f();
    } catch (const std::exception& thrown) {
      log(Error) << "in " << where << "(): " << thrown.what() << endlog();
    } catch (...) {
      log(Error) << "in " << where << "(): an exception" << endlog();
    }
    exception();
    return false;
  }

  void to_exception() {
    const TaskState before = state_;
    state_ = Exception;
    try {
      if (before >= Running) stopHook();
      if (before >= Stopped && initial_state_ == PreOperational) cleanupHook();
      exceptionHook();
    } catch (...) {
      log(Error) << "a hook throws while its task is brought into Exception" << endlog();
      state_ = FatalError;
    }
  }

  void step() {
    transition("updateHook", [this] {
      if (state_ == Running) updateHook();
      if (state_ == RunTimeError) errorHook();
      return true;
    });
  }

  ExecutionEngine engine_;
  const TaskState initial_state_;
  std::atomic<TaskState> state_;
};

}  // namespace base

inline void ExecutionEngine::step() {
  const std::lock_guard<std::recursive_mutex> running(running_);
  for (;;) {
    std::function<void()> message;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (messages_.empty()) break;
      message = std::move(messages_.front());
      messages_.pop_front();
    }
    message();
  }
  task_->step();
}

inline void internal::Engines::set_exception(ExecutionEngine& engine) { engine.task_->exception(); }

}  // namespace RTT

#endif
