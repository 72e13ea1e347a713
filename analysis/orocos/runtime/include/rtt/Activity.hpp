#ifndef MAUVE_RTT_ACTIVITY_HPP
#define MAUVE_RTT_ACTIVITY_HPP

#include <cmath>
#include <string>

#include "mauve/thread.hpp"
#include "rtt/base/ActivityInterface.hpp"
#include "rtt/os/fosi.h"

namespace RTT {

// A thread that runs a period after another; without a period, one whenever it is triggered.
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
      : base::ActivityInterface(runner),
        thread_(name, mauve::Scheduling{scheduler == ORO_SCHED_RT ? clamped(priority) : 0, nanoseconds(period),
                                        cpu_affinity}) {}

  ~Activity() override { thread_.stop(); }

  bool start() override { return thread_.start(runner_); }
  bool stop() override { return thread_.stop(); }
  bool isActive() const override { return thread_.is_active(); }

  // A thread of its own runs it, and nothing else.
  bool execute() override { return false; }
  bool trigger() override { return thread_.trigger(); }

  Seconds getPeriod() const override { return 1e-9 * static_cast<double>(thread_.period()); }
  bool setPeriod(Seconds period) override {
    if (!(period >= 0.0)) return false;
    thread_.set_period(nanoseconds(period));
    return true;
  }

  unsigned getCpuAffinity() const override { return static_cast<unsigned>((thread_.cpus() & mauve::Cpus(~0u)).to_ulong()); }
  bool setCpuAffinity(unsigned mask) override { return thread_.set_cpus(mask); }

  bool isSelf() const override { return thread_.is_self(); }

  // Not in RTT.
  mauve::PeriodicThread& thread() { return thread_; }

 private:
  static int clamped(int priority) { return priority < 1 ? 1 : priority > 99 ? 99 : priority; }
  static mauve::Nanoseconds nanoseconds(Seconds period) {
    return static_cast<mauve::Nanoseconds>(std::llround(period * 1e9));
  }

  mauve::PeriodicThread thread_;
};

}  // namespace RTT

#endif
