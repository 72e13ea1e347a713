// Loads the packages of its arguments, and does with all of them what the lines of its input say; it answers each.
//
//   update N   N steps of one component of each package, each in a thread of its own
//   preempted  gives the CPU time of the codel, in nanoseconds
//   lock       a codel shares a lock with another thread
//   open       a step of each: it begins, waits for the next line, and calls a codel
//
// Each answer ends with how often the clock of a thread's CPU time was read.

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <sys/syscall.h>
#include <thread>
#include <time.h>
#include <unistd.h>
#include <vector>

#include <dlfcn.h>

static std::atomic<int> clock_reads{0};

// Stands before the one of the C library, for the packages as well.
extern "C" int clock_gettime(clockid_t clock, struct timespec* time) noexcept {
  if (clock == CLOCK_THREAD_CPUTIME_ID) ++clock_reads;
  return static_cast<int>(syscall(SYS_clock_gettime, clock, time));
}

static void* function(void* package, const char* name) {
  void* found = package ? dlsym(package, name) : nullptr;
  if (!found) {
    std::fprintf(stderr, "%s\n", dlerror());
    std::exit(1);
  }
  return found;
}

static void answer(double value = 0) {
  std::printf("%.0f %d\n", value, clock_reads.load());
  std::fflush(stdout);
}

static void wait_for_line() {
  answer();
  std::string line;
  std::getline(std::cin, line);
}

int main(int count, char** arguments) {
  std::vector<void*> packages;
  for (int i = 1; i < count; ++i) packages.push_back(dlopen(arguments[i], RTLD_NOW | RTLD_GLOBAL));
  answer();
  std::string line;
  while (std::getline(std::cin, line)) {
    double value = 0;
    std::vector<std::thread> threads;
    for (void* package : packages) {
      if (line.compare(0, 7, "update ") == 0) {
        auto update = reinterpret_cast<void (*)(const char*)>(function(package, "update"));
        const int steps = std::atoi(line.c_str() + 7);
        threads.emplace_back([=] {
          for (int i = 0; i < steps; ++i) update("guidance");
        });
      } else if (line == "preempted") {
        auto spin = reinterpret_cast<double (*)(const char*)>(function(package, "preempted"));
        value = spin("guidance");
      } else if (line == "lock") {
        reinterpret_cast<void (*)(const char*)>(function(package, "lock"))("guidance");
      } else if (line == "open") {
        auto open = reinterpret_cast<void (*)(const char*, void (*)())>(function(package, "open_step"));
        open("guidance", wait_for_line);
      }
    }
    for (std::thread& thread : threads) thread.join();
    answer(value);
  }
}
