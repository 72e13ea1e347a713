#ifndef MAUVE_RTT_PORT_INTERFACE_HPP
#define MAUVE_RTT_PORT_INTERFACE_HPP

#include <string>

#include "rtt/ConnPolicy.hpp"
#include "rtt/FlowStatus.hpp"

namespace mauve {
class PeriodicThread;
}

namespace RTT {

class TaskContext;

namespace base {

class PortInterface {
 public:
  virtual ~PortInterface() {}
  PortInterface(const PortInterface&) = delete;
  PortInterface& operator=(const PortInterface&) = delete;

  const std::string& getName() const { return name_; }

  PortInterface& doc(const std::string& text) {
    doc_ = text;
    return *this;
  }

  virtual bool connected() const = 0;
  virtual void disconnect() = 0;
  virtual bool connectTo(PortInterface* other) = 0;
  virtual bool connectTo(PortInterface* other, const ConnPolicy& policy) = 0;

  // Not in RTT: what comes to an input, by the connections that it has, releases this thread. False for an output.
  virtual bool release(mauve::PeriodicThread*, unsigned int) { return false; }
  // Not in RTT, in the thread of the reader: whether a buffer of an input has something that was not read.
  virtual bool has_more() const { return false; }

 protected:
  explicit PortInterface(const std::string& name) : name_(name) {}

 private:
  friend class RTT::TaskContext;

  std::string name_;
  std::string doc_;
};

}  // namespace base
}  // namespace RTT

#endif
