#include <rtt/Component.hpp>
#include <rtt/TaskContext.hpp>

namespace several {

class Second : public RTT::TaskContext {
 public:
  explicit Second(const std::string& name) : RTT::TaskContext(name, PreOperational) {}
};

}  // namespace several

ORO_LIST_COMPONENT_TYPE(several::Second)
