#ifndef RTT_SHIM_SEND_HANDLE_HPP
#define RTT_SHIM_SEND_HANDLE_HPP

#include <memory>
#include <stdexcept>

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

  // RTT has one that does not compile, and it is what `handle = {}` means.
  SendHandle& operator=(base::DisposableInterface*) = delete;

  // The result, unless it is `void`, and then each argument that is a reference to something not constant.
  template <class... Out>
  SendStatus collectIfDone(Out&... out) const {
    if (!call_) return SendFailure;
    const SendStatus status = call_->status();
    if (status == CollectFailure) throw std::runtime_error("the operation has thrown an exception");
    if (status == SendSuccess) give(std::is_void<R>(), out...);
    return status;
  }

 private:
  friend class OperationCaller<R(A...)>;

  explicit SendHandle(std::shared_ptr<internal::SentCall<R(A...)>> call) : call_(std::move(call)) {}

  template <class... Out>
  void give(std::true_type, Out&... out) const {
    call_->give(out...);
  }

  template <class First, class... Out>
  void give(std::false_type, First& result, Out&... out) const {
    result = call_->result().get();
    call_->give(out...);
  }

  std::shared_ptr<internal::SentCall<R(A...)>> call_;
};

}  // namespace RTT

#endif
