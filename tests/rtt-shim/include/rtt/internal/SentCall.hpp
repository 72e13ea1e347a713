#ifndef RTT_SHIM_SENT_CALL_HPP
#define RTT_SHIM_SENT_CALL_HPP

#include <condition_variable>
#include <memory>
#include <mutex>
#include <tuple>
#include <type_traits>
#include <utility>

#include "rtt/SendStatus.hpp"
#include "rtt/internal/OperationBody.hpp"

namespace RTT {
namespace internal {

// An argument that waits for its call. What is passed by reference, constant or not, is not copied: it must live until
// the call has been executed, as with RTT.
template <class T>
class Argument {
 public:
  explicit Argument(const T& value) : value_(value) {}
  T& get() { return value_; }

 private:
  T value_;
};

template <class T>
class Argument<T&> {
 public:
  explicit Argument(T& value) : value_(&value) {}
  T& get() { return *value_; }

 private:
  T* value_;
};

// The result of a call, if it has one.
template <class R>
class Result {
 public:
  template <class F>
  void execute(F f) {
    value_.reset(new R(f()));
  }
  const R& get() const { return *value_; }

 private:
  std::unique_ptr<R> value_;
};

template <>
class Result<void> {
 public:
  template <class F>
  void execute(F f) {
    f();
  }
  void get() const {}
};

template <class Signature>
class SentCall;

// A call on its way to the owner of its operation, and back with the results.
template <class R, class... A>
class SentCall<R(A...)> {
 public:
  template <class... B>
  explicit SentCall(std::shared_ptr<OperationBody<R(A...)>> body, B&... arguments)
      : body_(std::move(body)), arguments_(Argument<A>(arguments)...) {}

  // In the thread of the owner.
  void execute() {
    bool failed = false;
    try {
      execute(std::index_sequence_for<A...>());
    } catch (...) {
      log(Error) << "an operation throws" << endlog();
      failed = true;
      if (body_->owner != nullptr) Engines::set_exception(*body_->owner);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    status_ = failed ? CollectFailure : SendSuccess;
    done_.notify_all();
  }

  SendStatus status() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return status_;
  }

  SendStatus wait() const {
    std::unique_lock<std::mutex> lock(mutex_);
    done_.wait(lock, [this] { return status_ != SendNotReady; });
    return status_;
  }

  const Result<R>& result() const { return result_; }

  // What the arguments that are no constant references hold, in their order.
  template <class... Out>
  void give(Out&... out) {
    give_from(std::integral_constant<std::size_t, 0>(), out...);
  }

 private:
  template <std::size_t... I>
  void execute(std::index_sequence<I...>) {
    result_.execute([this]() -> R { return body_->function(std::get<I>(arguments_).get()...); });
  }

  template <class T>
  struct IsOut : std::integral_constant<bool, std::is_lvalue_reference<T>::value &&
                                                  !std::is_const<std::remove_reference_t<T>>::value> {};

  template <std::size_t I>
  using Position = std::integral_constant<std::size_t, I>;

  void give_from(Position<sizeof...(A)>) {}

  template <std::size_t I, class... Out>
  void give_from(Position<I>, Out&... out) {
    give_one(IsOut<std::tuple_element_t<I, std::tuple<A...>>>(), Position<I>(), out...);
  }

  template <std::size_t I, class... Out>
  void give_one(std::false_type, Position<I>, Out&... out) {
    give_from(Position<I + 1>(), out...);
  }

  template <std::size_t I, class First, class... Rest>
  void give_one(std::true_type, Position<I>, First& first, Rest&... rest) {
    first = std::get<I>(arguments_).get();
    give_from(Position<I + 1>(), rest...);
  }

  const std::shared_ptr<OperationBody<R(A...)>> body_;
  std::tuple<Argument<A>...> arguments_;
  Result<R> result_;
  mutable std::mutex mutex_;
  mutable std::condition_variable done_;
  SendStatus status_ = SendNotReady;
};

}  // namespace internal
}  // namespace RTT

#endif
