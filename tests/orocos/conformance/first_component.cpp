#include <rtt/Component.hpp>
#include <rtt/TaskContext.hpp>

namespace several {

class First : public RTT::TaskContext {
 public:
  explicit First(const std::string& name) : RTT::TaskContext(name, PreOperational) {}
};

}  // namespace several

ORO_LIST_COMPONENT_TYPE(several::First)
ORO_CREATE_COMPONENT_LIBRARY()
