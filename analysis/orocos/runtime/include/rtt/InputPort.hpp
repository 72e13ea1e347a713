#ifndef MAUVE_RTT_INPUT_PORT_HPP
#define MAUVE_RTT_INPUT_PORT_HPP

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

#include "rtt/base/PortInterface.hpp"
#include "rtt/internal/Connections.hpp"

namespace RTT {

template <class T>
class OutputPort;

template <class T>
class InputPort : public base::PortInterface {
 public:
  InputPort(const std::string& name = "unnamed", const ConnPolicy& default_policy = ConnPolicy())
      : base::PortInterface(name),
        default_policy_(default_policy),
        connections_(std::make_shared<internal::Connections<T>>()) {}

  ~InputPort() override { connections_->disconnect(); }

  FlowStatus read(T& sample) { return read(sample, true); }

  // The first connection with something new has it; where none has, the one that was read last.
  FlowStatus read(T& sample, bool copy_old_data) {
    const auto& connections = connections_->all();
    for (const auto& connection : connections) {
      if (connection.channel->read(sample, false) == NewData) {
        last_read_ = connection.channel.get();
        number_ = connection.channel->last_number();
        return NewData;
      }
    }
    for (const auto& connection : connections) {
      if (connection.channel.get() != last_read_) continue;
      // Something new may have come in the meantime.
      const FlowStatus status = connection.channel->read(sample, copy_old_data);
      number_ = connection.channel->last_number();
      return status;
    }
    return NoData;
  }

  FlowStatus readNewest(T& sample, bool copy_old_data = true) {
    const FlowStatus status = read(sample, copy_old_data);
    if (status == NewData) {
      while (read(sample, false) == NewData) {
      }
    }
    return status;
  }

  void clear() {
    for (const auto& connection : connections_->all()) connection.channel->clear();
    last_read_ = nullptr;
    number_ = 0;
  }

  // Not in RTT: the number of the sample that was read last, among those that its port has written; 0 without one.
  std::uint64_t number() const { return number_; }

  bool release(mauve::PeriodicThread* thread, unsigned int input) override {
    for (const auto& connection : connections_->all()) connection.channel->release(thread, input);
    return true;
  }

  bool has_more() const override {
    const auto& all = connections_->all();
    return std::any_of(all.begin(), all.end(), [](const auto& connection) { return connection.channel->has_more(); });
  }

  bool connected() const override { return !connections_->all().empty(); }
  void disconnect() override { connections_->disconnect(); }
  bool connectTo(base::PortInterface* other) override { return connectTo(other, default_policy_); }

  bool connectTo(base::PortInterface* other, const ConnPolicy& policy) override {
    OutputPort<T>* const output = dynamic_cast<OutputPort<T>*>(other);
    return output != nullptr && output->connectTo(this, policy);
  }

 private:
  friend class OutputPort<T>;

  const ConnPolicy default_policy_;
  const std::shared_ptr<internal::Connections<T>> connections_;
  // Compared only: the connection may be gone.
  const internal::Channel<T>* last_read_ = nullptr;
  std::uint64_t number_ = 0;
};

}  // namespace RTT

// A connection that is made from here needs the other end.
#include "rtt/OutputPort.hpp"

#endif
