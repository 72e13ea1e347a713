#ifndef MAUVE_RTT_RUNNABLE_INTERFACE_HPP
#define MAUVE_RTT_RUNNABLE_INTERFACE_HPP

namespace RTT {
namespace base {

// What an activity runs: the engine of a task.
class RunnableInterface {
 public:
  virtual ~RunnableInterface() {}
  // One period: executes the calls that wait, then the hook of the task's state. Returns whether the task was running.
  virtual bool step() = 0;
  // Executes the calls that wait.
  virtual void serve() = 0;
};

}  // namespace base
}  // namespace RTT

#endif
