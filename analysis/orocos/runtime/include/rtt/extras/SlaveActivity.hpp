#ifndef MAUVE_RTT_SLAVE_ACTIVITY_HPP
#define MAUVE_RTT_SLAVE_ACTIVITY_HPP

#include <thread>

#include "rtt/base/ActivityInterface.hpp"

namespace RTT {
namespace extras {

// An activity without a thread: each `execute` is a period, in the thread of whoever calls it.
class SlaveActivity : public base::ActivityInterface {
 public:
  explicit SlaveActivity(double period, base::RunnableInterface* runner = nullptr)
      : base::ActivityInterface(runner), period_(period), thread_(std::this_thread::get_id()) {}

  bool start() override {
    if (active_) return false;
    active_ = true;
    return true;
  }

  bool stop() override {
    if (!active_) return false;
    active_ = false;
    return true;
  }

  bool execute() override {
    if (!active_ || runner_ == nullptr) return false;
    runner_->step();
    return true;
  }

  bool isActive() const override { return active_; }
  bool trigger() override { return false; }
  Seconds getPeriod() const override { return period_; }
  bool setPeriod(Seconds period) override {
    period_ = period;
    return true;
  }
  unsigned getCpuAffinity() const override { return ~0u; }
  bool setCpuAffinity(unsigned) override { return false; }
  bool isSelf() const override { return thread_ == std::this_thread::get_id(); }

 private:
  Seconds period_;
  const std::thread::id thread_;
  bool active_ = false;
};

}  // namespace extras
}  // namespace RTT

#endif
