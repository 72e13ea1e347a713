#ifndef MAUVE_RTT_OPERATION_CALLER_HPP
#define MAUVE_RTT_OPERATION_CALLER_HPP

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

  // It is ready from here on, also if the signature is another; then it returns false.
  virtual bool implement(const std::shared_ptr<OperationInterfacePart>& part) = 0;

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
    const bool is_direct =
        body_->thread == ClientThread || body_->owner == caller_ || body_->owner->is_self();
    if (is_direct) return body_->function(arguments...);
    const SendHandle<R(A...)> handle = send(arguments...);
    if (handle.call_ == nullptr || handle.call_->wait() != SendSuccess) {
      throw std::runtime_error("the operation " + getName() + " was not executed");
    }
    return handle.call_->result().get();
  }

  SendHandle<R(A...)> send(A... arguments) {
    if (!ready()) return SendHandle<R(A...)>();
    if (!body_) throw std::runtime_error("the operation " + getName() + " has another signature");
    internal::SentCall<R(A...)>* const call = calls_->take();
    if (call == nullptr) return SendHandle<R(A...)>();
    call->prepare(*body_, arguments...);
    SendHandle<R(A...)> handle(calls_, call);
    // The owner's reference.
    call->refer();
    if (body_->thread == ClientThread) {
      call->execute();
    } else if (!body_->owner->process(*call)) {
      call->release();
      return SendHandle<R(A...)>();
    }
    return handle;
  }

 private:
  bool implement(const std::shared_ptr<OperationInterfacePart>& part) override {
    body_ = std::dynamic_pointer_cast<internal::OperationBody<R(A...)>>(part);
    is_connected_ = true;
    if (!body_) return false;
    // The owner keeps the calls that its queue may have, also when the caller has gone.
    calls_ = std::make_shared<internal::SentCalls<R(A...)>>();
    body_->calls.push_back(calls_);
    return true;
  }

  bool is_connected_ = false;
  // Nothing where the operation that it is connected to has another signature.
  std::shared_ptr<internal::OperationBody<R(A...)>> body_;
  std::shared_ptr<internal::SentCalls<R(A...)>> calls_;
};

}  // namespace RTT

#endif
