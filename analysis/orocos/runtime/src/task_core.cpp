// The states of tasks, and the engines that run them.

#include "rtt/base/TaskCore.hpp"

#include <exception>

#include "mauve/clock.hpp"
#include "rtt/Logger.hpp"

namespace RTT {
namespace base {

template <class F>
bool TaskCore::guarded(const char* where, F f) {
  try {
    return f();
  } catch (const std::exception& thrown) {
    log(Error) << "in " << where << "(): " << thrown.what() << endlog();
  } catch (...) {
    log(Error) << "in " << where << "(): an exception" << endlog();
  }
  has_thrown_ = true;
  exception();
  return false;
}

bool TaskCore::changed_in(const char* where) {
  log(Error) << "in " << where << "(): the hook has changed the state, and returned true" << endlog();
  exception();
  return false;
}

bool TaskCore::configure() {
  if (state_ != Stopped && state_ != PreOperational) return false;
  return guarded("configure", [this] {
    target_ = Stopped;
    const bool is_configured = configureHook();
    if (is_configured && target_ != Stopped) return changed_in("configure");
    enter(is_configured ? Stopped : PreOperational);
    return is_configured;
  });
}

bool TaskCore::start() {
  if (state_ != Stopped) return false;
  return guarded("start", [this] {
    target_ = Running;
    if (!startHook()) {
      target_ = Stopped;
      return false;
    }
    if (target_ != Running) return changed_in("start");
    // What the hook wrote is visible to the thread of the activity when it sees this state.
    state_ = Running;
    trigger();
    return true;
  });
}

bool TaskCore::stop() {
  if (state_ < Running) return false;
  return guarded("stop", [this] {
    // Either the thread sees this before its next period, or it is waited for.
    target_ = Stopped;
    while (is_busy_ && !engine_.is_self()) mauve::pause();
    if (state_ < Running) return false;
    stopHook();
    state_ = Stopped;
    return true;
  });
}

bool TaskCore::cleanup() {
  if (state_ != Stopped) return false;
  return guarded("cleanup", [this] {
    target_ = PreOperational;
    cleanupHook();
    state_ = PreOperational;
    return true;
  });
}

bool TaskCore::recover() {
  if (state_ == Exception) {
    enter(initial_state_);
  } else if (state_ == RunTimeError && target_ >= Running) {
    enter(Running);
  } else {
    return false;
  }
  return true;
}

void TaskCore::error() {
  if (target_ >= Running) enter(RunTimeError);
}

void TaskCore::exception() {
  const TaskState before = state_;
  enter(Exception);
  try {
    if (before >= Running) stopHook();
    if (before >= Stopped && initial_state_ == PreOperational) cleanupHook();
    exceptionHook();
  } catch (...) {
    log(Error) << "a hook throws while its task enters the exception state" << endlog();
    enter(FatalError);
  }
}

bool TaskCore::step() {
  const bool was_running = state_ >= Running && target_ >= Running;
  if (was_running) {
    guarded("updateHook", [this] {
      if (state_ == Running) updateHook();
      if (state_ == RunTimeError) errorHook();
      return true;
    });
  }
  return was_running;
}

}  // namespace base

bool ExecutionEngine::step() {
  task_->is_busy_ = true;
  execute_messages();
  const bool was_running = task_->step();
  task_->is_busy_ = false;
  return was_running;
}

void ExecutionEngine::serve() {
  task_->is_busy_ = true;
  execute_messages();
  task_->is_busy_ = false;
}

void ExecutionEngine::execute_messages() {
  while (internal::Message* message = take_messages()) {
    while (message != nullptr) {
      // When it has been executed, its caller may send it again.
      internal::Message* const next = message->next_;
      message->execute();
      message = next;
    }
  }
}

bool ExecutionEngine::process(internal::Message& message) {
  if (activity_ == nullptr || !activity_->isActive() || task_->getTaskState() == base::TaskCore::FatalError) return false;
  message.next_ = messages_.load(std::memory_order_relaxed);
  while (!messages_.compare_exchange_weak(message.next_, &message, std::memory_order_release,
                                          std::memory_order_relaxed)) {
  }
  activity_->trigger();
  return true;
}

void ExecutionEngine::failed() {
  try {
    throw;
  } catch (const std::exception& thrown) {
    log(Error) << "an operation throws: " << thrown.what() << endlog();
  } catch (...) {
    log(Error) << "an operation throws an exception" << endlog();
  }
  task_->exception();
}

internal::Message* ExecutionEngine::take_messages() {
  internal::Message* last = messages_.exchange(nullptr, std::memory_order_acquire);
  internal::Message* first = nullptr;
  while (last != nullptr) {
    internal::Message* const before = last->next_;
    last->next_ = first;
    first = last;
    last = before;
  }
  return first;
}

void ExecutionEngine::abandon_messages() {
  internal::Message* message = take_messages();
  while (message != nullptr) {
    internal::Message* const next = message->next_;
    message->abandon();
    message = next;
  }
}

}  // namespace RTT
