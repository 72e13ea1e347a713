#ifndef MAUVE_RTT_CHANNEL_HPP
#define MAUVE_RTT_CHANNEL_HPP

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "mauve/thread.hpp"
#include "rtt/ConnPolicy.hpp"
#include "rtt/FlowStatus.hpp"

namespace RTT {
namespace internal {

// A connection of an output port with an input port: the samples that were written and not yet read, and the one that was read
// last. One thread writes and one thread reads. Neither waits for the other, locks or allocates, whenever it is preempted; copying
// a sample may allocate if its type does and the sample is greater than those of `reserve`.
//
// Samples are in slots, and each slot has one owner at each instant: the writer (free slots), the reader (the sample read last),
// or the queue, which is a ring of slot numbers. A full circular buffer drops its oldest sample after the new one is in the queue, so
// that the reader finds the newest complete sample while the next one is written: writer and reader both take the oldest by
// advancing `tail_`, and only one of them succeeds. Of `size + 3` slots, the queue has at most `size` between two writes; the reader
// holds two for the moment in which it exchanges them; so the writer always has a free one. The counters do not wrap in a robot's
// life, so a slot number that was read from the ring before another thread advanced `tail_` is never used.
template <class T>
class Channel {
 public:
  explicit Channel(const ConnPolicy& policy)
      : size_(policy.type == ConnPolicy::DATA ? 1 : static_cast<std::size_t>(policy.size)),
        drops_oldest_(policy.type != ConnPolicy::BUFFER),
        is_buffer_(policy.type != ConnPolicy::DATA),
        slots_(new T[size_ + 3]()),
        numbers_(new std::uint64_t[size_ + 3]()),
        queue_(new std::atomic<std::size_t>[size_ + 1]),
        returned_(new std::atomic<std::size_t>[size_ + 3]) {
    for (std::size_t slot = 0; slot < size_ + 1; ++slot) queue_[slot].store(0, std::memory_order_relaxed);
    for (std::size_t slot = 0; slot < size_ + 3; ++slot) give_back(slot);
  }

  // Makes the free slots as large as this sample. Only while no other thread uses the channel.
  void reserve(const T& sample) {
    for (std::uint64_t free = returned_begin_; free != returned_end_; ++free) {
      slots_[returned_[free % (size_ + 3)]] = sample;
    }
  }

  // In the thread of the writer. `number` is that of the sample among those that its port has written.
  WriteStatus write(const T& sample, std::uint64_t number) {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    std::uint64_t tail = tail_.load(std::memory_order_acquire);
    if (!drops_oldest_ && head - tail == size_) return WriteFailure;
    const bool has_spare = spare_ != none;
    const std::size_t slot = has_spare ? spare_ : first_returned();
    slots_[slot] = sample;
    numbers_[slot] = number;
    // Only now, since copying may throw.
    if (has_spare) {
      spare_ = none;
    } else {
      ++returned_begin_;
    }
    queue_[head % (size_ + 1)].store(slot, std::memory_order_relaxed);
    head_.store(head + 1, std::memory_order_release);
    tail = tail_.load(std::memory_order_acquire);
    if (head + 1 - tail > size_) {
      const std::size_t oldest = queue_[tail % (size_ + 1)].load(std::memory_order_relaxed);
      // If this fails, the reader has taken the oldest.
      if (tail_.compare_exchange_strong(tail, tail + 1, std::memory_order_acq_rel)) spare_ = oldest;
    }
    if (released_ != nullptr) released_->arrive(input_);
    return WriteSuccess;
  }

  // In the thread of the reader.
  FlowStatus read(T& sample, bool copy_old_data) {
    if (take_oldest()) {
      sample = slots_[last_];
      return NewData;
    }
    if (!has_last_) return NoData;
    if (copy_old_data) sample = slots_[last_];
    return OldData;
  }

  // Before its writer and its reader run: what is written releases this thread.
  void release(mauve::PeriodicThread* thread, unsigned int input) {
    released_ = thread;
    input_ = input;
  }

  // In the thread of the reader: whether it is a buffer with something that was not read.
  bool has_more() const {
    return is_buffer_ && head_.load(std::memory_order_acquire) != tail_.load(std::memory_order_acquire);
  }

  // In the thread of the reader: the number of the sample that was read last; 0 without one.
  std::uint64_t last_number() const { return has_last_ ? numbers_[last_] : 0; }

  // In the thread of the reader.
  void clear() {
    while (take_oldest()) {
    }
    if (has_last_) give_back(last_);
    has_last_ = false;
  }

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);

  // Exchanges the sample that was read last for the oldest one of the queue, if there is one.
  bool take_oldest() {
    std::uint64_t tail = tail_.load(std::memory_order_acquire);
    std::size_t slot;
    do {
      if (head_.load(std::memory_order_acquire) == tail) return false;
      slot = queue_[tail % (size_ + 1)].load(std::memory_order_relaxed);
    } while (!tail_.compare_exchange_strong(tail, tail + 1, std::memory_order_acq_rel, std::memory_order_acquire));
    if (has_last_) give_back(last_);
    last_ = slot;
    has_last_ = true;
    return true;
  }

  // The reader gives a slot back to the writer.
  void give_back(std::size_t slot) {
    const std::uint64_t end = returned_end_.load(std::memory_order_relaxed);
    returned_[end % (size_ + 3)].store(slot, std::memory_order_relaxed);
    returned_end_.store(end + 1, std::memory_order_release);
  }

  std::size_t first_returned() {
    // There is one: see above. This load makes the reader's last use of the slot visible.
    returned_end_.load(std::memory_order_acquire);
    return returned_[returned_begin_ % (size_ + 3)].load(std::memory_order_relaxed);
  }

  const std::size_t size_;
  const bool drops_oldest_, is_buffer_;
  const std::unique_ptr<T[]> slots_;
  const std::unique_ptr<std::uint64_t[]> numbers_;
  // The numbers of the slots with unread samples: those from `tail_` to `head_`, modulo the size.
  const std::unique_ptr<std::atomic<std::size_t>[]> queue_;
  std::atomic<std::uint64_t> head_{0}, tail_{0};
  // The numbers of free slots, from `returned_begin_` (the writer's) to `returned_end_` (the reader's).
  const std::unique_ptr<std::atomic<std::size_t>[]> returned_;
  std::atomic<std::uint64_t> returned_end_{0};
  std::uint64_t returned_begin_ = 0;
  // The slot of the sample that was dropped: the writer's, for the next one.
  std::size_t spare_ = none;
  // The thread that is released, and the number of the input among those that release it.
  mauve::PeriodicThread* released_ = nullptr;
  unsigned int input_ = 0;
  // The reader's.
  std::size_t last_ = 0;
  bool has_last_ = false;
};

template <class T>
constexpr std::size_t Channel<T>::none;

}  // namespace internal
}  // namespace RTT

#endif
