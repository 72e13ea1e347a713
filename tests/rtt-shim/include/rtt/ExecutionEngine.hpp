#ifndef RTT_SHIM_EXECUTION_ENGINE_HPP
#define RTT_SHIM_EXECUTION_ENGINE_HPP

#include <deque>
#include <functional>
#include <mutex>

#include "rtt/base/ActivityInterface.hpp"
#include "rtt/base/RunnableInterface.hpp"

namespace RTT {

namespace base {
class TaskCore;
}
namespace internal {
class Engines;
}

// What runs a task: in each step first the operations that others asked for, then the hook of the task's state.
class ExecutionEngine : public base::RunnableInterface {
 public:
  explicit ExecutionEngine(base::TaskCore* task) : task_(task) {}
  ExecutionEngine(const ExecutionEngine&) = delete;
  ExecutionEngine& operator=(const ExecutionEngine&) = delete;

  void step() override;

 private:
  friend class base::TaskCore;
  friend class internal::Engines;

  base::TaskCore* const task_;
  base::ActivityInterface* activity_ = nullptr;
  // Held while anything of the task runs; the task itself may stop from within.
  std::recursive_mutex running_;
  std::mutex mutex_;
  std::deque<std::function<void()>> messages_;
};

namespace internal {

// What operations do with engines.
class Engines {
 public:
  // Does `engine` run in the calling thread?
  static bool is_self(const ExecutionEngine& engine) {
    return engine.activity_ != nullptr && engine.activity_->isSelf();
  }

  // Is anything there that will run it?
  static bool process(ExecutionEngine& engine, std::function<void()> message) {
    if (engine.activity_ == nullptr || !engine.activity_->isActive()) return false;
    {
      const std::lock_guard<std::mutex> lock(engine.mutex_);
      engine.messages_.push_back(std::move(message));
    }
    engine.activity_->trigger();
    return true;
  }

  static void set_exception(ExecutionEngine& engine);
};

}  // namespace internal
}  // namespace RTT

// What a step does with the task.
#include "rtt/base/TaskCore.hpp"

#endif
