// A component that writes scans, and one that writes what it reads.

#include <rtt/Component.hpp>

#include "messages.hpp"

namespace rig {
namespace {

class Laser : public RTT::TaskContext {
 public:
  explicit Laser(const std::string& name) : RTT::TaskContext(name, PreOperational), ranges_("ranges") {
    addPort("ranges", ranges_);
    addProperty("count", count_);
  }
  bool configureHook() override {
    scan_.ranges.assign(static_cast<std::size_t>(count_), 1.5f);
    scan_.header.frame_id = "laser";
    ranges_.setDataSample(scan_);
    return true;
  }
  void updateHook() override {
    scan_.header.stamp.sec = static_cast<std::int32_t>(++number_);
    ranges_.write(scan_);
  }

 private:
  RTT::OutputPort<sensor_msgs::msg::LaserScan> ranges_;
  sensor_msgs::msg::LaserScan scan_{};
  int count_ = 360;
  unsigned number_ = 0;
};

template <class Message>
class Echo : public RTT::TaskContext {
 public:
  explicit Echo(const std::string& name) : RTT::TaskContext(name, PreOperational), in_("in"), out_("out") {
    addPort("in", in_);
    addPort("out", out_);
  }
  void updateHook() override {
    while (in_.read(sample_, false) == RTT::NewData) out_.write(sample_);
  }

 private:
  RTT::InputPort<Message> in_;
  RTT::OutputPort<Message> out_;
  Message sample_{};
};

typedef Echo<geometry_msgs::msg::Twist> TwistEcho;
typedef Echo<sensor_msgs::msg::Image> ImageEcho;
typedef Echo<rig::msg::All> AllEcho;

}  // namespace
}  // namespace rig

ORO_CREATE_COMPONENT_LIBRARY()
using namespace rig;
ORO_LIST_COMPONENT_TYPE(Laser)
ORO_LIST_COMPONENT_TYPE(TwistEcho)
ORO_LIST_COMPONENT_TYPE(ImageEcho)
ORO_LIST_COMPONENT_TYPE(AllEcho)
