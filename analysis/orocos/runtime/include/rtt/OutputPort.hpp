#ifndef MAUVE_RTT_OUTPUT_PORT_HPP
#define MAUVE_RTT_OUTPUT_PORT_HPP

#include <cstdint>
#include <memory>
#include <string>

#include "rtt/InputPort.hpp"
#include "rtt/base/PortInterface.hpp"
#include "rtt/internal/Connections.hpp"

namespace RTT {

template <class T>
class OutputPort : public base::PortInterface {
 public:
  OutputPort(const std::string& name = "unnamed", bool keep_last_written_value = true)
      : base::PortInterface(name),
        keeps_last_(keep_last_written_value),
        connections_(std::make_shared<internal::Connections<T>>()) {}

  ~OutputPort() override { connections_->disconnect(); }

  WriteStatus write(const T& sample) {
    if (keeps_last_) {
      last_ = sample;
      has_last_ = true;
    }
    ++number_;
    WriteStatus result = NotConnected;
    for (const auto& connection : connections_->all()) {
      const WriteStatus status = connection.channel->write(sample, number_);
      if (result == NotConnected || status == WriteFailure) result = status;
    }
    return result;
  }

  // Not in RTT: the number of samples that were written, also those that a full buffer lost.
  std::uint64_t number() const { return number_; }

  // Makes the connections of this port as large as this sample, so that writing one of its size does not allocate.
  void setDataSample(const T& sample) {
    sample_ = sample;
    if (!has_last_) last_ = sample;
    for (const auto& connection : connections_->all()) connection.channel->reserve(sample);
  }

  bool connected() const override { return !connections_->all().empty(); }
  void disconnect() override { connections_->disconnect(); }

  bool connectTo(base::PortInterface* other) override {
    InputPort<T>* const input = dynamic_cast<InputPort<T>*>(other);
    return input != nullptr && connectTo(input, input->default_policy_);
  }

  bool connectTo(base::PortInterface* other, const ConnPolicy& policy) override {
    InputPort<T>* const input = dynamic_cast<InputPort<T>*>(other);
    if (input == nullptr || (policy.type != ConnPolicy::DATA && policy.size < 1)) return false;
    const auto channel = std::make_shared<internal::Channel<T>>(policy);
    channel->reserve(sample_);
    if (policy.init && has_last_) channel->write(last_, number_);
    internal::Connections<T>::connect(connections_, input->connections_, channel);
    return true;
  }

 private:
  const bool keeps_last_;
  T sample_{};
  T last_{};
  bool has_last_ = false;
  std::uint64_t number_ = 0;
  const std::shared_ptr<internal::Connections<T>> connections_;
};

}  // namespace RTT

#endif
