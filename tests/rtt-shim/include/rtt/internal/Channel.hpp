#ifndef RTT_SHIM_CHANNEL_HPP
#define RTT_SHIM_CHANNEL_HPP

#include <cstddef>
#include <deque>
#include <mutex>

#include "rtt/ConnPolicy.hpp"
#include "rtt/FlowStatus.hpp"

namespace RTT {
namespace internal {

// A connection of one output port with one input port: what was written and not yet read, and what was read last.
template <class T>
class Channel {
 public:
  explicit Channel(const ConnPolicy& policy) : policy_(policy) {}

  WriteStatus write(const T& sample) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t size = policy_.type == ConnPolicy::DATA ? 1 : static_cast<std::size_t>(policy_.size);
    if (fresh_.size() >= size) {
      if (policy_.type == ConnPolicy::BUFFER) return WriteFailure;
      fresh_.pop_front();
    }
    fresh_.push_back(sample);
    return WriteSuccess;
  }

  FlowStatus read(T& sample, bool copy_old_data) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!fresh_.empty()) {
      last_.assign(1, fresh_.front());
      fresh_.pop_front();
      sample = last_.front();
      return NewData;
    }
    if (last_.empty()) return NoData;
    if (copy_old_data) sample = last_.front();
    return OldData;
  }

  void clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    fresh_.clear();
    last_.clear();
  }

 private:
  const ConnPolicy policy_;
  std::mutex mutex_;
  std::deque<T> fresh_;
  // At most one.
  std::deque<T> last_;
};

}  // namespace internal
}  // namespace RTT

#endif
