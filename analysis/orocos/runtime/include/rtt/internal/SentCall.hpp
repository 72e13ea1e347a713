#ifndef MAUVE_RTT_SENT_CALL_HPP
#define MAUVE_RTT_SENT_CALL_HPP

#include <atomic>
#include <cstddef>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>

#include "rtt/ExecutionEngine.hpp"
#include "rtt/SendStatus.hpp"
#include "rtt/internal/OperationBody.hpp"

namespace RTT {
namespace internal {

// An argument that waits for its call. What is passed by reference, constant or not, is not copied: it must live until
// the call has been executed, as with RTT.
template <class T>
class Argument {
 public:
  void set(const T& value) { value_ = value; }
  T& get() { return value_; }

 private:
  T value_{};
};

template <class T>
class Argument<T&> {
 public:
  void set(T& value) { value_ = &value; }
  T& get() { return *value_; }

 private:
  T* value_ = nullptr;
};

// The result of a call, if it has one.
template <class R>
class Result {
 public:
  template <class F>
  void execute(F f) {
    value_ = f();
  }
  const R& get() const { return value_; }

 private:
  R value_{};
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

// A call on its way to the owner of its operation, and back with the results. It is used again when nobody refers to it: neither
// the owner's queue nor a handle.
template <class R, class... A>
class SentCall<R(A...)> : public Message {
 public:
  // In the thread of the caller: takes the call, if nobody refers to it. Then the caller does.
  bool take() {
    int nobody = 0;
    return references_.compare_exchange_strong(nobody, 1, std::memory_order_acquire, std::memory_order_relaxed);
  }
  void refer() { references_.fetch_add(1, std::memory_order_relaxed); }
  void release() { references_.fetch_sub(1, std::memory_order_release); }

  // `B` and `A` are the same types.
  template <class... B>
  void prepare(OperationBody<R(A...)>& body, B&... arguments) {
    body_ = &body;
    status_.store(SendNotReady, std::memory_order_relaxed);
    set(std::index_sequence_for<A...>(), arguments...);
  }

  // In the thread of the owner.
  void execute() override {
    bool failed = false;
    try {
      execute(std::index_sequence_for<A...>());
    } catch (...) {
      failed = true;
      body_->owner->failed();
    }
    status_.store(failed ? CollectFailure : SendSuccess, std::memory_order_release);
    Waiting::notify(status_);
    release();
  }

  // The owner has ended, and does not execute it.
  void abandon() override { release(); }

  SendStatus status() const { return static_cast<SendStatus>(status_.load(std::memory_order_acquire)); }

  // Not in real-time threads.
  SendStatus wait() const {
    while (status() == SendNotReady) Waiting::wait(status_, SendNotReady);
    return status();
  }

  const Result<R>& result() const { return result_; }

  // What the arguments that are no constant references hold, in their order.
  template <class... Out>
  void give(Out&... out) {
    give_from(std::integral_constant<std::size_t, 0>(), out...);
  }

 private:
  template <std::size_t... I, class... B>
  void set(std::index_sequence<I...>, B&... arguments) {
    const int all[] = {0, (std::get<I>(arguments_).set(arguments), 0)...};
    static_cast<void>(all);
  }

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

  OperationBody<R(A...)>* body_ = nullptr;
  std::tuple<Argument<A>...> arguments_;
  Result<R> result_;
  std::atomic<int> references_{0};
  std::atomic<int> status_{SendNotReady};
};

// The calls of a required operation: a caller allocates none.
template <class Signature>
class SentCalls {
 public:
  // The most calls that wait for their owner or whose handles are kept.
  static constexpr std::size_t most = 64;

  SentCalls() : calls_(new SentCall<Signature>[most]) {}

  // A call that nobody refers to, if there is one; the caller refers to it.
  SentCall<Signature>* take() {
    for (std::size_t tries = 0; tries < most; ++tries) {
      SentCall<Signature>& call = calls_[next_];
      next_ = (next_ + 1) % most;
      if (call.take()) return &call;
    }
    return nullptr;
  }

 private:
  const std::unique_ptr<SentCall<Signature>[]> calls_;
  std::size_t next_ = 0;
};

}  // namespace internal
}  // namespace RTT

#endif
