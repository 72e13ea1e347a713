// Topics of ROS 2 for a robot: a gateway between its ports and Cyclone DDS.

#ifndef MAUVE_ROS2_HPP
#define MAUVE_ROS2_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mauve/cdr.hpp"
#include "mauve/execution.hpp"
#include "mauve/gateway.hpp"
#include "mauve/robot.hpp"
#include "rtt/InputPort.hpp"
#include "rtt/OutputPort.hpp"

// What idlc makes for a type: dds/dds.h.
struct dds_topic_descriptor;

namespace mauve {

// The node of a robot. Threads of components only touch the channels between their ports and those of the gateway, which neither lock nor
// allocate; the gateway moves the samples in its periods, as many of a topic as its depth at most.
class Ros2 : public Gateway {
 public:
  // Who may see the robot: programs on this computer, or all computers that its network reaches.
  enum Discovery { Localhost, Subnet };

  // The name of a type in DDS, such as `sensor_msgs::msg::dds_::LaserScan_`; a descriptor of idlc has it, too.
  struct TypeName {
    TypeName(const char* of) : name(of) {}
    TypeName(const dds_topic_descriptor* of);
    std::string name;
  };

  struct Topic {
    // The port as the model names it: `ros2.` and this is the key of its access. The instance and the port as scripts name them.
    std::string key, instance, port;
    // Absolute, such as `/uav/scan`.
    std::string name;
    // The hash of the type, RIHS01_…, and its name.
    std::string hash;
    TypeName type;
    int depth;
    bool is_reliable, is_transient_local;
    // Greater samples are dropped, and those whose sequences take more memory.
    std::size_t max_bytes;
    // Who is at the other end of a connection between hosts, such as `host eyes`, and is missed when it is not there; empty: anyone.
    std::string other_end{};
  };

  // `space` is the namespace, `/` for none. The robot outlives it.
  Ros2(Robot& robot, const std::string& space, const std::string& node);
  ~Ros2() override;

  // The environment variable ROS_DOMAIN_ID wins.
  void domain(int number);
  void discovery(Discovery discovery);
  // Its activity, as Robot::activity, and its name.
  void gateway(std::int64_t period, int priority, const Cpus& cpus, std::int64_t deadline, std::int64_t response,
               const std::string& name = "ros2");

  // Samples that an output writes go to a topic.
  template <class Message>
  void publish(const Topic& topic) {
    add(topic, std::unique_ptr<Port>(new Published<Message>(topic.key)));
  }
  // Samples of a topic come to an input.
  template <class Message>
  void subscribe(const Topic& topic) {
    add(topic, std::unique_ptr<Port>(new Subscribed<Message>(topic.key)));
  }

  std::vector<End> ends() override;
  void open(bool allows_non_realtime) override;
  bool step() override;
  void look() override;
  void close() override;
  bool has_thread(const std::string& name) const override;
  std::string report() const override;
  std::string absence() const override;

  // The gateway's end of a connection, and one sample that is kept between periods.
  class Port {
   public:
    virtual ~Port() {}
    virtual RTT::base::PortInterface& end() = 0;
    virtual bool is_published() const = 0;
    // Takes the next sample that the component has written, if there is one; its size, 0 where a bound is exceeded; its bytes.
    virtual bool take() { return false; }
    virtual std::size_t size() const { return 0; }
    virtual void write(char*) const {}
    // Reads a sample of this size, and with this room; gives it to the component. False where it is malformed.
    virtual bool deliver(const char*, std::size_t, std::size_t) { return false; }
    // The number of that sample among those that the port's writer has written.
    virtual std::uint64_t number() const = 0;
  };

 private:
  template <class Message>
  class Published : public Port {
   public:
    explicit Published(const std::string& name) : port_(name) {}
    RTT::base::PortInterface& end() override { return port_; }
    bool is_published() const override { return true; }
    bool take() override { return port_.read(sample_, false) == RTT::NewData; }
    std::size_t size() const override { return cdr::size(sample_); }
    void write(char* to) const override { cdr::write(sample_, to); }
    std::uint64_t number() const override { return port_.number(); }

   private:
    RTT::InputPort<Message> port_;
    Message sample_{};
  };

  template <class Message>
  class Subscribed : public Port {
   public:
    explicit Subscribed(const std::string& name) : port_(name, false) {}
    RTT::base::PortInterface& end() override { return port_; }
    bool is_published() const override { return false; }
    bool deliver(const char* from, std::size_t size, std::size_t room) override {
      if (!cdr::read(from, size, room, sample_)) return false;
      port_.write(sample_);
      return true;
    }
    std::uint64_t number() const override { return port_.number(); }

   private:
    RTT::OutputPort<Message> port_;
    Message sample_{};
  };

  void add(const Topic& topic, std::unique_ptr<Port> port);

  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace mauve

#endif
