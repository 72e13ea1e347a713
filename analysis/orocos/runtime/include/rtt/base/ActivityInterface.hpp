#ifndef MAUVE_RTT_ACTIVITY_INTERFACE_HPP
#define MAUVE_RTT_ACTIVITY_INTERFACE_HPP

#include "rtt/base/RunnableInterface.hpp"

namespace RTT {

typedef double Seconds;

namespace base {

class ActivityInterface {
 public:
  explicit ActivityInterface(RunnableInterface* runner = nullptr) : runner_(runner) {}
  virtual ~ActivityInterface() {}
  ActivityInterface(const ActivityInterface&) = delete;
  ActivityInterface& operator=(const ActivityInterface&) = delete;

  virtual bool start() = 0;
  virtual bool stop() = 0;
  virtual bool isActive() const = 0;
  virtual bool execute() = 0;
  virtual bool trigger() = 0;
  virtual Seconds getPeriod() const = 0;
  virtual bool setPeriod(Seconds period) = 0;
  virtual unsigned getCpuAffinity() const = 0;
  virtual bool setCpuAffinity(unsigned mask) = 0;
  // Does the calling thread run it?
  virtual bool isSelf() const = 0;

  bool run(RunnableInterface* runner) {
    if (isActive()) return false;
    runner_ = runner;
    return true;
  }

 protected:
  RunnableInterface* runner_;
};

}  // namespace base
}  // namespace RTT

#endif
