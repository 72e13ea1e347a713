#include <rtt/Component.hpp>
#include <rtt/TaskContext.hpp>

namespace one {

class Only : public RTT::TaskContext {
 public:
  explicit Only(const std::string& name) : RTT::TaskContext(name, PreOperational) {}
};

}  // namespace one

ORO_CREATE_COMPONENT(one::Only)
