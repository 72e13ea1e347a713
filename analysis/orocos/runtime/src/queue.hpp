// A queue of fixed size, into which threads put what another thread writes to a file.

#ifndef MAUVE_QUEUE_HPP
#define MAUVE_QUEUE_HPP

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace mauve {

// Any thread puts, one thread takes; none waits for another. A thread that is preempted while it puts delays only when its entry
// and those after it are taken. Each cell has a number that says whose turn it is: that of the entry that may be put there, or one
// more when the entry can be taken. (D. Vyukov's bounded queue.)
template <class T>
class Queue {
 public:
  explicit Queue(std::size_t size) : size_(size), cells_(new Cell[size]) {
    for (std::size_t number = 0; number < size; ++number) cells_[number].turn.store(number);
  }

  // Puts what `fill` makes of a cell. False, and counted, if the queue is full.
  template <class Fill>
  bool put(Fill fill) {
    std::uint64_t number = last_.load(std::memory_order_relaxed);
    while (true) {
      Cell& cell = cells_[number % size_];
      const std::uint64_t turn = cell.turn.load(std::memory_order_acquire);
      if (turn == number) {
        if (!last_.compare_exchange_weak(number, number + 1, std::memory_order_relaxed)) continue;
        fill(cell.value);
        cell.turn.store(number + 1, std::memory_order_release);
        return true;
      }
      if (turn < number) {
        lost_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
      number = last_.load(std::memory_order_relaxed);
    }
  }

  // Gives the first entry to `use`, if there is one.
  template <class Use>
  bool take(Use use) {
    Cell& cell = cells_[first_ % size_];
    if (cell.turn.load(std::memory_order_acquire) != first_ + 1) return false;
    use(cell.value);
    cell.turn.store(first_ + size_, std::memory_order_release);
    ++first_;
    return true;
  }

  // The entries that found the queue full.
  std::uint64_t lost() const { return lost_.load(std::memory_order_relaxed); }

 private:
  struct Cell {
    std::atomic<std::uint64_t> turn{0};
    T value;
  };

  const std::size_t size_;
  const std::unique_ptr<Cell[]> cells_;
  std::atomic<std::uint64_t> last_{0}, lost_{0};
  std::uint64_t first_ = 0;
};

}  // namespace mauve

#endif
