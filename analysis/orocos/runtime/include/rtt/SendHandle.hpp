#ifndef MAUVE_RTT_SEND_HANDLE_HPP
#define MAUVE_RTT_SEND_HANDLE_HPP

#include <memory>
#include <stdexcept>
#include <utility>

#include "rtt/SendStatus.hpp"
#include "rtt/internal/SentCall.hpp"

namespace RTT {

namespace base {
class DisposableInterface;
}

template <class Signature>
class OperationCaller;
template <class Signature>
class SendHandle;

template <class R, class... A>
class SendHandle<R(A...)> {
 public:
  SendHandle() {}
  SendHandle(const SendHandle& other) : calls_(other.calls_), call_(other.call_) {
    if (call_ != nullptr) call_->refer();
  }
  SendHandle(SendHandle&& other) noexcept : calls_(std::move(other.calls_)), call_(other.call_) {
    other.call_ = nullptr;
  }
  SendHandle& operator=(SendHandle other) noexcept {
    std::swap(calls_, other.calls_);
    std::swap(call_, other.call_);
    return *this;
  }
  ~SendHandle() {
    if (call_ != nullptr) call_->release();
  }

  // RTT has one that does not compile, and it is what `handle = {}` means.
  SendHandle& operator=(base::DisposableInterface*) = delete;

  // The result, unless it is `void`, and then each argument that is a reference to something not constant.
  template <class... Out>
  SendStatus collectIfDone(Out&... out) const {
    if (call_ == nullptr) return SendFailure;
    const SendStatus status = call_->status();
    if (status == CollectFailure) throw std::runtime_error("the operation has thrown an exception");
    if (status == SendSuccess) give(std::is_void<R>(), out...);
    return status;
  }

 private:
  friend class OperationCaller<R(A...)>;

  typedef std::shared_ptr<internal::SentCalls<R(A...)>> Calls;

  // Refers to the call, as its sender did.
  SendHandle(Calls calls, internal::SentCall<R(A...)>* call) : calls_(std::move(calls)), call_(call) {}

  template <class... Out>
  void give(std::true_type, Out&... out) const {
    call_->give(out...);
  }

  template <class First, class... Out>
  void give(std::false_type, First& result, Out&... out) const {
    result = call_->result().get();
    call_->give(out...);
  }

  // Keeps the call alive, also after its caller.
  Calls calls_;
  internal::SentCall<R(A...)>* call_ = nullptr;
};

}  // namespace RTT

#endif
