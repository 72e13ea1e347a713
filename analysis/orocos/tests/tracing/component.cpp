// Executes spans as a generated component does. TRACE_HEADER is the header of its package.

#include TRACE_HEADER

#include <stdexcept>
#include <string>
#include <time.h>

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

extern "C" double preempted(const char* name) { return Component(name).preempted(); }

extern "C" void open_step(const char* name, void (*wait)()) { Component(name).open(wait); }
