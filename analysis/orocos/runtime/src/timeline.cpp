#include "timeline.hpp"

#include <linux/futex.h>
#include <pthread.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <climits>

#include "context.hpp"
#include "rtt/ExecutionEngine.hpp"

namespace mauve {
namespace {

static_assert(sizeof(std::atomic<int>) == sizeof(int), "a futex is an int");

const int* word(const std::atomic<int>& value) { return reinterpret_cast<const int*>(&value); }

Nanoseconds read(clockid_t clock) {
  timespec time = {};
  clock_gettime(clock, &time);
  return time.tv_sec * Nanoseconds(1000000000) + time.tv_nsec;
}

void futex_wait(const std::atomic<int>& value, int present, Nanoseconds until) {
  timespec time = {};
  time.tv_sec = until / 1000000000;
  time.tv_nsec = until % 1000000000;
  // The end of the waiting is an instant of the monotonic clock. A changed value, a signal and the end of the time all end it:
  // the caller looks which.
  syscall(SYS_futex, word(value), FUTEX_WAIT_BITSET_PRIVATE, present, until == never ? nullptr : &time, nullptr,
          FUTEX_BITSET_MATCH_ANY);
}

void futex_wake(const std::atomic<int>& value) {
  syscall(SYS_futex, word(value), FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

// The computer's clock and scheduler.
class RealTime : public Timeline {
 public:
  bool is_virtual() const override { return false; }
  Nanoseconds now() const override { return read(CLOCK_MONOTONIC); }
  void begin(Worker&) override {}
  void end(Worker&) override {}
  void wait(Worker& worker, int seen, Nanoseconds until) override { futex_wait(worker.signal, seen, until); }
  // Without the right to do so, it changes nothing. The kernel alone is not told: locks with a ceiling would lower the priority.
  void set_raised(Worker& worker, bool is_raised) override {
    pthread_setschedprio(pthread_self(), is_raised ? highest_priority : worker.scheduling.priority);
  }
  void wake(Worker& worker) override {
    worker.signal.fetch_add(1);
    futex_wake(worker.signal);
  }
  void started(Worker&) override {}

  void spend(Worker&, Nanoseconds time) override {
    // The clock of the CPU time needs a system call: that of the real time shows when it cannot have passed yet.
    const Nanoseconds end = read(CLOCK_THREAD_CPUTIME_ID) + time;
    for (Nanoseconds left = time; left > 0; left = end - read(CLOCK_THREAD_CPUTIME_ID)) {
      const Nanoseconds earliest = read(CLOCK_MONOTONIC) + left;
      while (read(CLOCK_MONOTONIC) < earliest) {
      }
    }
  }
};

RealTime real_time;
std::atomic<Timeline*> present{&real_time};

}  // namespace

Nanoseconds real_now() { return read(CLOCK_MONOTONIC); }

Timeline& timeline() { return *present.load(std::memory_order_relaxed); }
void set_timeline(Timeline& timeline) { present = &timeline; }

Nanoseconds now() { return timeline().now(); }

Nanoseconds cpu_time() {
  const Context* const context = present_context();
  if (context != nullptr && timeline().is_virtual()) return context->worker->simulated.executed;
  return read(CLOCK_THREAD_CPUTIME_ID);
}

void pause() {
  const timespec moment = {0, 100000};
  nanosleep(&moment, nullptr);
}

}  // namespace mauve

namespace RTT {
namespace internal {

void Waiting::wait(const std::atomic<int>& value, int present) { mauve::futex_wait(value, present, mauve::never); }
void Waiting::notify(const std::atomic<int>& value) { mauve::futex_wake(value); }

}  // namespace internal
}  // namespace RTT
