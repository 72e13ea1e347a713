// What moves samples between ports of a robot and the world outside.

#ifndef MAUVE_GATEWAY_HPP
#define MAUVE_GATEWAY_HPP

#include <string>
#include <vector>

#include "rtt/base/PortInterface.hpp"
#include "rtt/base/RunnableInterface.hpp"

namespace mauve {

// An activity of the robot that executes no component: see Robot::gateway. Its period is `step`, in its own thread. The main thread calls
// all else. What it throws before the start is why the robot does not start.
class Gateway : public RTT::base::RunnableInterface {
 public:
  // A port of an instance, and the gateway's port that it is connected with.
  struct End {
    std::string instance, port;
    RTT::base::PortInterface* own;
    // Whether the instance writes it; the number of values that the connection keeps, 0 for the last one.
    bool is_output;
    int buffer;
  };
  virtual std::vector<End> ends() = 0;
  // After the ports are connected, before any thread of an activity exists.
  virtual void open(bool allows_non_realtime) = 0;
  // Now and then while the robot runs.
  virtual void look() = 0;
  // After its thread has ended, and also where `open` has failed.
  virtual void close() = 0;
  // Whether a thread of this name is one of those that it needs besides its own.
  virtual bool has_thread(const std::string& name) const = 0;
  // What the run was like: lines that end with a newline.
  virtual std::string report() const = 0;
  // Why there is no gateway on a virtual clock: a line.
  virtual std::string absence() const = 0;
  void serve() override {}
};

}  // namespace mauve

#endif
