#ifndef RTT_SHIM_OPERATION_CALLER_HPP
#define RTT_SHIM_OPERATION_CALLER_HPP

#include <memory>
#include <stdexcept>
#include <string>

#include "rtt/SendHandle.hpp"
#include "rtt/internal/OperationBody.hpp"
#include "rtt/internal/SentCall.hpp"

namespace RTT {

class ServiceRequester;

namespace base {

// A required operation, whatever its signature is.
class OperationCallerBaseInvoker {
 public:
  virtual ~OperationCallerBaseInvoker() {}
  virtual bool ready() const = 0;
  const std::string& getName() const { return name_; }

 protected:
  OperationCallerBaseInvoker(const std::string& name, ExecutionEngine* caller)
      : caller_(caller), name_(name) {}

  ExecutionEngine* caller_;

 private:
  friend class RTT::ServiceRequester;

  // It is ready from here on, also where the signature is another.
  virtual void implement(const std::shared_ptr<OperationInterfacePart>& part) = 0;

  std::string name_;
};

}  // namespace base

template <class R, class... A>
class OperationCaller<R(A...)> : public base::OperationCallerBaseInvoker {
 public:
  OperationCaller(std::string name, ExecutionEngine* caller = nullptr)
      : base::OperationCallerBaseInvoker(name, caller) {}

  bool ready() const override { return is_connected_; }

  R operator()(A... arguments) { return call(arguments...); }

  // In one's own thread, or when the owner has executed it.
  R call(A... arguments) {
    if (!ready()) throw std::runtime_error("the operation " + getName() + " is not connected");
    if (!body_) throw std::runtime_error("the operation " + getName() + " has another signature");
    const bool is_direct = body_->thread == ClientThread || body_->owner == caller_ ||
                           internal::Engines::is_self(*body_->owner);
    if (is_direct) return body_->function(arguments...);
    const SendHandle<R(A...)> handle = send(arguments...);
    if (!handle.call_ || handle.call_->wait() != SendSuccess) {
      throw std::runtime_error("the operation " + getName() + " was not executed");
    }
    return handle.call_->result().get();
  }

  SendHandle<R(A...)> send(A... arguments) {
    if (!ready()) return SendHandle<R(A...)>();
    if (!body_) throw std::runtime_error("the operation " + getName() + " has another signature");
    const auto sent = std::make_shared<internal::SentCall<R(A...)>>(body_, arguments...);
    if (body_->thread == ClientThread) {
      sent->execute();
    } else if (!internal::Engines::process(*body_->owner, [sent] { sent->execute(); })) {
      return SendHandle<R(A...)>();
    }
    return SendHandle<R(A...)>(sent);
  }

 private:
  void implement(const std::shared_ptr<OperationInterfacePart>& part) override {
    body_ = std::dynamic_pointer_cast<internal::OperationBody<R(A...)>>(part);
    is_connected_ = true;
  }

  bool is_connected_ = false;
  // Nothing where the operation that it is connected to has another signature.
  std::shared_ptr<internal::OperationBody<R(A...)>> body_;
};

}  // namespace RTT

#endif
