#ifndef RTT_SHIM_RUNNABLE_INTERFACE_HPP
#define RTT_SHIM_RUNNABLE_INTERFACE_HPP

namespace RTT {
namespace base {

// What an activity runs: the engine of a task.
class RunnableInterface {
 public:
  virtual ~RunnableInterface() {}
  // One period.
  virtual void step() = 0;
};

}  // namespace base
}  // namespace RTT

#endif
