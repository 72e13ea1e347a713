#ifndef RTT_SHIM_OUTPUT_PORT_HPP
#define RTT_SHIM_OUTPUT_PORT_HPP

#include <memory>
#include <mutex>
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
      const std::lock_guard<std::mutex> lock(mutex_);
      last_ = std::make_shared<const T>(sample);
    }
    WriteStatus result = NotConnected;
    for (const auto& connection : connections_->all()) {
      const WriteStatus status = connection.channel->write(sample);
      if (result == NotConnected || status == WriteFailure) result = status;
    }
    return result;
  }

  // Only tells how large the samples of a connection are, which nothing here needs.
  void setDataSample(const T&) {}

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
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (policy.init && last_) channel->write(*last_);
    }
    internal::Connections<T>::connect(connections_, input->connections_, channel);
    return true;
  }

 private:
  const bool keeps_last_;
  std::mutex mutex_;
  std::shared_ptr<const T> last_;
  const std::shared_ptr<internal::Connections<T>> connections_;
};

}  // namespace RTT

#endif
