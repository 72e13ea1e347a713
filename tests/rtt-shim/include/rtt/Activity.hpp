#ifndef RTT_SHIM_ACTIVITY_HPP
#define RTT_SHIM_ACTIVITY_HPP

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "rtt/base/ActivityInterface.hpp"
#include "rtt/os/fosi.h"

namespace RTT {

// A thread that runs a period after another; without a period, one whenever it is triggered. Scheduler, priority
// and CPUs have no effect.
class Activity : public base::ActivityInterface {
 public:
  explicit Activity(base::RunnableInterface* runner = nullptr, const std::string& name = "Activity")
      : Activity(ORO_SCHED_OTHER, 0, 0.0, 0u, runner, name) {}

  Activity(int priority, base::RunnableInterface* runner = nullptr, const std::string& name = "Activity")
      : Activity(ORO_SCHED_RT, priority, 0.0, 0u, runner, name) {}

  Activity(int priority, Seconds period, base::RunnableInterface* runner = nullptr,
           const std::string& name = "Activity")
      : Activity(ORO_SCHED_RT, priority, period, 0u, runner, name) {}

  Activity(int scheduler, int priority, base::RunnableInterface* runner = nullptr,
           const std::string& name = "Activity")
      : Activity(scheduler, priority, 0.0, 0u, runner, name) {}

  Activity(int scheduler, int priority, Seconds period, base::RunnableInterface* runner = nullptr,
           const std::string& name = "Activity")
      : Activity(scheduler, priority, period, 0u, runner, name) {}

  Activity(int scheduler, int priority, Seconds period, unsigned cpu_affinity,
           base::RunnableInterface* runner = nullptr, const std::string& name = "Activity")
      : base::ActivityInterface(runner), period_(period), cpu_affinity_(cpu_affinity) {
    static_cast<void>(scheduler);
    static_cast<void>(priority);
    static_cast<void>(name);
  }

  ~Activity() override { stop(); }

  bool start() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (active_) return false;
    active_ = true;
    triggered_ = false;
    thread_ = std::thread([this] { loop(); });
    return true;
  }

  bool stop() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!active_) return false;
      active_ = false;
    }
    wake_.notify_all();
    if (isSelf()) {
      thread_.detach();
    } else {
      thread_.join();
    }
    return true;
  }

  bool isActive() const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return active_;
  }

  // A thread of its own runs it, and nothing else.
  bool execute() override { return false; }

  bool trigger() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!active_) return false;
      triggered_ = true;
    }
    wake_.notify_all();
    return true;
  }

  Seconds getPeriod() const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return period_;
  }

  bool setPeriod(Seconds period) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    period_ = period;
    return true;
  }

  unsigned getCpuAffinity() const override { return cpu_affinity_; }
  bool setCpuAffinity(unsigned mask) override {
    cpu_affinity_ = mask;
    return true;
  }

  bool isSelf() const override { return thread_.get_id() == std::this_thread::get_id(); }

 private:
  typedef std::chrono::steady_clock Clock;

  void loop() {
    std::unique_lock<std::mutex> lock(mutex_);
    Clock::time_point release = Clock::now();
    while (active_) {
      if (period_ > 0.0) {
        release += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period_));
        wake_.wait_until(lock, release, [this] { return !active_; });
      } else {
        wake_.wait(lock, [this] { return !active_ || triggered_; });
      }
      if (!active_) return;
      triggered_ = false;
      lock.unlock();
      if (runner_ != nullptr) runner_->step();
      lock.lock();
    }
  }

  Seconds period_;
  unsigned cpu_affinity_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool active_ = false;
  bool triggered_ = false;
  std::thread thread_;
};

}  // namespace RTT

#endif
