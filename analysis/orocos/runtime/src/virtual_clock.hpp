// A clock that passes as fast as the computer can, and the scheduler of its threads.

#ifndef MAUVE_VIRTUAL_CLOCK_HPP
#define MAUVE_VIRTUAL_CLOCK_HPP

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

#include "timeline.hpp"

namespace mauve {

// Fixed-priority preemptive scheduling, as SCHED_FIFO does it: a ready worker never waits while a CPU that it may use is idle or
// executes a worker of lower priority; workers of equal priority do not preempt each other; a worker keeps its CPU where it can.
//
// The code of a worker takes no virtual time, except for what it spends. One worker's code runs at a time, while all others are
// stopped, and what comes first depends on virtual instants, priorities and the order in which the workers were started. So a run
// is the same each time.
//
// Code runs when its worker is on a CPU. At one instant, the workers whose execution ends there go on before others are released:
// a job that ends at the release of another one is not preempted by it.
class VirtualClock : public Timeline {
 public:
  explicit VirtualClock(const Cpus& cpus) : cpus_(cpus) {}

  bool is_virtual() const override { return true; }
  Nanoseconds now() const override { return now_; }
  void begin(Worker& worker) override;
  void end(Worker& worker) override;
  void wait(Worker& worker, int seen, Nanoseconds until) override;
  void spend(Worker& worker, Nanoseconds time) override;
  void set_raised(Worker& worker, bool is_raised) override;
  void wake(Worker& worker) override;
  void started(Worker& worker) override;

  enum class End { Idle, Stuck };

  // Lets the clock pass until all workers wait for ever. `look` is called now and then; true means that it should end soon.
  // `Stuck`: the code of a worker runs for longer than `patience_s` seconds, or two if it should end soon: see `running`.
  End run(int patience_s, const std::function<bool()>& look);
  // From now on the threads run without the scheduler, so that they can end.
  void finish();
  // The worker whose code is running.
  const Worker* running() const { return current_.load(); }

 private:
  typedef std::unique_lock<std::mutex> Lock;

  // Chooses whose code runs next, after letting time pass if no worker on a CPU has any; nobody's if all wait for ever.
  void choose();
  // Chooses, and waits until this worker goes on.
  void give_way(Lock& lock, Worker& worker);
  void make_ready(Worker& worker);
  void place();
  Worker* next_with_code() const;

  const Cpus cpus_;
  std::mutex mutex_;
  std::condition_variable started_, idle_;
  // In the order in which they were started.
  std::vector<Worker*> workers_;
  std::atomic<Worker*> current_{nullptr};
  std::atomic<Nanoseconds> now_{0};
  std::uint64_t ready_count_ = 0, turns_ = 0;
  // Whether the threads run without the scheduler.
  bool is_over_ = false;
};

}  // namespace mauve

#endif
