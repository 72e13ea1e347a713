#include <probe/probe-codels.hpp>

#include <cstdio>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static double nanoseconds(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec * 1e9 + now.tv_nsec;
}

namespace probe {

void work(int milliseconds) {
  const double least = milliseconds * 1e6;
  const double before = nanoseconds(CLOCK_THREAD_CPUTIME_ID);
  const double begin = nanoseconds(CLOCK_MONOTONIC);
  double cpu = 0;
  while (cpu < least || nanoseconds(CLOCK_MONOTONIC) - begin < cpu + least)
    cpu = nanoseconds(CLOCK_THREAD_CPUTIME_ID) - before;
  std::printf("%ld work %.0f\n", syscall(SYS_gettid), cpu);
}

}  // namespace probe
