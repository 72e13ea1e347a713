// Executes spans as a generated component does. TRACE_HEADER is the header of its package.

#include TRACE_HEADER
#ifdef LOCK_HEADER
#include LOCK_HEADER
#endif

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <time.h>
#include <unistd.h>

namespace {

int add(int a, int b) { return a + b; }

void nothing() {}

void fail() { throw std::runtime_error("this codel fails"); }

double nanoseconds(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec * 1e9 + now.tv_nsec;
}

// Uses 50 ms of CPU time, and as much more as it takes to be preempted for 50 ms.
double spin() {
  const double used = nanoseconds(CLOCK_THREAD_CPUTIME_ID);
  const double begin = nanoseconds(CLOCK_MONOTONIC);
  for (;;) {
    const double cpu = nanoseconds(CLOCK_THREAD_CPUTIME_ID) - used;
    if (cpu >= 50e6 && nanoseconds(CLOCK_MONOTONIC) - begin >= cpu + 50e6) return cpu;
  }
}

#ifdef LOCK_HEADER
LOCK_NAMESPACE::MauveLock bus("bus");

// Waits for another thread that has the lock.
void share() {
  std::atomic<bool> is_held{false};
  std::thread other([&] {
    const std::lock_guard<LOCK_NAMESPACE::MauveLock> held(bus);
    is_held = true;
    usleep(50000);
  });
  while (!is_held) usleep(100);
  const std::lock_guard<LOCK_NAMESPACE::MauveLock> held(bus);
  other.join();
  // A thread may have no lock twice.
  try {
    bus.lock();
    std::abort();
  } catch (const std::system_error&) {
  }
}
#endif

class Component {
 public:
  explicit Component(const char* name) : name_(name) {}

  void update() {
    MAUVE_TRACE_COMPONENT(getName());
    {
      MAUVE_TRACE_PROGRAM(getName(), "Guidance", "Waiting", "", "run");
      sum_ = MAUVE_TRACE_CODEL(getName(), "motion.add", ::add(sum_, 2));
      if (sum_ > 0 && MAUVE_TRACE_CODEL(getName(), "motion.add", ::add(1, 1)) == 2)
        MAUVE_TRACE_CODEL(getName(), "motion.nothing", ::nothing());
    }
    try {
      MAUVE_TRACE_PROGRAM(getName(), "Guidance", "Waiting", "asked", "guard");
      MAUVE_TRACE_CODEL(getName(), "motion.fail", ::fail());
    } catch (const std::runtime_error&) {
    }
  }

  double preempted() {
    MAUVE_TRACE_PROGRAM(getName(), "Guidance", "Waiting", "", "handle");
    return MAUVE_TRACE_CODEL(getName(), "motion.spin", ::spin());
  }

#ifdef LOCK_HEADER
  void lock() { MAUVE_TRACE_CODEL(getName(), "motion.share", ::share()); }
#endif

  // A step that waits.
  void open(void (*wait)()) {
    MAUVE_TRACE_COMPONENT(getName());
    wait();
    MAUVE_TRACE_CODEL(getName(), "motion.nothing", ::nothing());
  }

 private:
  const std::string& getName() const { return name_; }

  std::string name_;
  int sum_ = 0;
};

}  // namespace

extern "C" void update(const char* name) { Component(name).update(); }

#ifdef LOCK_HEADER
extern "C" void lock(const char* name) { Component(name).lock(); }
#endif

extern "C" double preempted(const char* name) { return Component(name).preempted(); }

extern "C" void open_step(const char* name, void (*wait)()) { Component(name).open(wait); }
