#include "virtual_clock.hpp"

#include <algorithm>
#include <chrono>
#include <tuple>

namespace mauve {
namespace {

enum { cpu_count = Cpus().size() };

typedef decltype(Worker::simulated) Simulated;

int priority_of(const Worker& worker) { return worker.simulated.is_raised ? highest_priority : worker.scheduling.priority; }

}  // namespace

void VirtualClock::started(Worker& worker) {
  Lock lock(mutex_);
  workers_.push_back(&worker);
  started_.wait(lock, [&] { return worker.simulated.state != Simulated::Absent; });
}

void VirtualClock::begin(Worker& worker) {
  Lock lock(mutex_);
  worker.simulated.until = never;
  make_ready(worker);
  started_.notify_all();
  worker.simulated.turn.wait(lock, [&] { return current_ == &worker || is_over_; });
}

void VirtualClock::end(Worker& worker) {
  const Lock lock(mutex_);
  workers_.erase(std::remove(workers_.begin(), workers_.end(), &worker), workers_.end());
  worker.simulated.state = Simulated::Absent;
  worker.simulated.is_on_cpu = false;
  choose();
}

void VirtualClock::wait(Worker& worker, int seen, Nanoseconds until) {
  Lock lock(mutex_);
  if (is_over_) {
    lock.unlock();
    pause();
    return;
  }
  if (worker.signal.load() != seen || until <= now_) return;
  worker.simulated.state = Simulated::Waiting;
  worker.simulated.is_on_cpu = false;
  worker.simulated.until = until;
  give_way(lock, worker);
}

void VirtualClock::spend(Worker& worker, Nanoseconds time) {
  Lock lock(mutex_);
  if (time <= 0 || is_over_) return;
  worker.simulated.remaining = time;
  give_way(lock, worker);
}

void VirtualClock::set_raised(Worker& worker, bool is_raised) {
  Lock lock(mutex_);
  worker.simulated.is_raised = is_raised;
  if (is_raised || is_over_) return;
  worker.simulated.yields = true;
  give_way(lock, worker);
}

void VirtualClock::wake(Worker& worker) {
  const Lock lock(mutex_);
  worker.signal.fetch_add(1);
  if (worker.simulated.state == Simulated::Waiting) make_ready(worker);
}

void VirtualClock::make_ready(Worker& worker) {
  worker.simulated.state = Simulated::Ready;
  worker.simulated.remaining = 0;
  worker.simulated.ready_since = ready_count_++;
}

void VirtualClock::give_way(Lock& lock, Worker& worker) {
  choose();
  worker.simulated.turn.wait(lock, [&] { return current_ == &worker || is_over_; });
}

// Gives each CPU its worker: the workers choose one after the other, by priority; of equal priority, those on a CPU first, then
// those that are ready for the longest time.
void VirtualClock::place() {
  std::vector<Worker*> ready;
  for (Worker* worker : workers_) {
    if (worker->simulated.state == Simulated::Ready) ready.push_back(worker);
  }
  std::sort(ready.begin(), ready.end(), [](const Worker* one, const Worker* other) {
    const auto key = [](const Worker* it) {
      return std::make_tuple(-priority_of(*it), !it->simulated.is_on_cpu, it->simulated.ready_since);
    };
    return key(one) < key(other);
  });
  Worker* before[cpu_count] = {};
  for (Worker* worker : ready) {
    if (worker->simulated.is_on_cpu) before[worker->simulated.cpu] = worker;
  }
  Cpus free = cpus_;
  for (Worker* worker : ready) {
    Simulated& simulated = worker->simulated;
    const Cpus& wanted = worker->scheduling.cpus;
    const Cpus allowed = wanted.none() ? free : free & wanted;
    // An idle CPU, or else that of the worker with the lowest priority; of several, the one where it executed last.
    const auto cost = [&](int cpu) {
      const Worker* const other = before[cpu];
      const bool is_idle = other == nullptr || other == worker;
      return std::make_tuple(is_idle ? -1 : priority_of(*other), cpu != simulated.cpu);
    };
    int chosen = -1;
    for (int cpu = 0; cpu < cpu_count; ++cpu) {
      if (allowed[static_cast<std::size_t>(cpu)] && (chosen < 0 || cost(cpu) < cost(chosen))) chosen = cpu;
    }
    simulated.is_on_cpu = chosen >= 0;
    if (chosen < 0) continue;
    simulated.cpu = chosen;
    free.reset(static_cast<std::size_t>(chosen));
  }
}

Worker* VirtualClock::next_with_code() const {
  Worker* next = nullptr;
  for (Worker* worker : workers_) {
    const Simulated& simulated = worker->simulated;
    if (simulated.state != Simulated::Ready || !simulated.is_on_cpu || simulated.remaining > 0 || simulated.yields) continue;
    if (next == nullptr || priority_of(*worker) > priority_of(*next)) next = worker;
  }
  return next;
}

void VirtualClock::choose() {
  current_ = nullptr;
  while (!is_over_) {
    // The code of the workers on a CPU, until all of them spend time or wait.
    if (Worker* const next = next_with_code()) {
      current_ = next;
      ++turns_;
      next->simulated.turn.notify_all();
      return;
    }
    // What ends at an instant has ended now; what is released there comes before other workers go on.
    for (Worker* worker : workers_) {
      if (worker->simulated.state == Simulated::Waiting && worker->simulated.until <= now_) make_ready(*worker);
      worker->simulated.yields = false;
    }
    place();
    if (next_with_code() != nullptr) continue;
    Nanoseconds next = never;
    for (const Worker* worker : workers_) {
      const Simulated& simulated = worker->simulated;
      if (simulated.state == Simulated::Waiting) next = std::min(next, simulated.until);
      if (simulated.is_on_cpu) next = std::min(next, now_ + simulated.remaining);
    }
    if (next == never) break;
    const Nanoseconds passed = next - now_;
    now_ = next;
    for (Worker* worker : workers_) {
      Simulated& simulated = worker->simulated;
      if (!simulated.is_on_cpu) continue;
      simulated.remaining -= passed;
      simulated.executed += passed;
    }
  }
  idle_.notify_all();
}

VirtualClock::End VirtualClock::run(int patience_s, const std::function<bool()>& look) {
  Lock lock(mutex_);
  choose();
  std::uint64_t turns = 0;
  // The time in which no other worker has had its turn.
  int waited_ms = 0;
  while (!idle_.wait_for(lock, std::chrono::milliseconds(50), [this] { return current_ == nullptr; })) {
    // What it does may need the lock.
    lock.unlock();
    const bool is_ending = look();
    lock.lock();
    waited_ms = turns == turns_ ? waited_ms + 50 : 0;
    turns = turns_;
    if (waited_ms >= (is_ending ? 2000 : patience_s * 1000)) return End::Stuck;
    // All waited for ever; what `look` has done may have changed that.
    if (current_ == nullptr) choose();
  }
  return End::Idle;
}

void VirtualClock::finish() {
  const Lock lock(mutex_);
  is_over_ = true;
  for (Worker* worker : workers_) worker->simulated.turn.notify_all();
}

}  // namespace mauve
