// Preloaded into a program on the virtual clock, this lets LTTng record that clock: when something happens, how much CPU time the
// thread has used, and its priority and CPUs. A thread that the virtual clock does not let execute is preempted, and does not wait.

#include <fcntl.h>
#include <lttng/ust-clock.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>

extern "C" {
// This header does not say that it is C.
#include <lttng/ust-getcpu.h>
}

#include "context.hpp"
#include "timeline.hpp"

// Of the runtime, which other programs do not have.
namespace mauve {
extern __attribute__((weak)) Context* present_context();
extern __attribute__((weak)) Timeline& timeline();
}  // namespace mauve

namespace {

// The time of an event: of the virtual clock, which goes on where that of the program before ended. The daemon of LTTng writes
// times, too: all processes have the latest one in common, in a file.
std::atomic<std::uint64_t>* latest = nullptr;
std::uint64_t before = 0;

std::uint64_t event_time() {
  const bool is_virtual = mauve::timeline != nullptr && mauve::timeline().is_virtual();
  if (is_virtual) latest->store(before + static_cast<std::uint64_t>(mauve::timeline().now()));
  return latest->load();
}

void open_clock() {
  const char* const path = std::getenv("VIRTUAL_CLOCK");
  const int file = path == nullptr ? -1 : open(path, O_RDWR);
  void* const memory = file < 0 ? MAP_FAILED : mmap(nullptr, sizeof *latest, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) std::abort();
  latest = static_cast<std::atomic<std::uint64_t>*>(memory);
  before = latest->load();
}

int no_identifier(char* identifier) {
  std::strcpy(identifier, "00000000-0000-0000-0000-000000000000");
  return 0;
}

// The thread on the virtual clock that calls; none otherwise.
const mauve::Worker* worker() {
  if (mauve::present_context == nullptr) return nullptr;
  const mauve::Context* const context = mauve::present_context();
  return context == nullptr ? nullptr : context->worker;
}

// The first CPU that the thread may use. Much happens at one virtual instant, and the events of one CPU stay in their order.
int event_cpu() {
  const mauve::Cpus cpus = worker() == nullptr ? mauve::Cpus(1) : worker()->scheduling.cpus;
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
    if (cpus[cpu]) return static_cast<int>(cpu);
  }
  return 0;
}

}  // namespace

extern "C" {

void lttng_ust_clock_plugin_init() {
  open_clock();
  const bool is_set = lttng_ust_trace_clock_set_read64_cb(event_time) == 0 &&
                      lttng_ust_trace_clock_set_freq_cb([]() -> std::uint64_t { return 1000000000; }) == 0 &&
                      lttng_ust_trace_clock_set_uuid_cb(no_identifier) == 0 &&
                      lttng_ust_trace_clock_set_name_cb([] { return "virtual"; }) == 0 &&
                      lttng_ust_trace_clock_set_description_cb([] { return "virtual clock"; }) == 0 &&
                      lttng_ust_enable_trace_clock_override() == 0;
  if (!is_set) std::abort();
}

void lttng_ust_getcpu_plugin_init() { lttng_ust_getcpu_override(event_cpu); }

int clock_gettime(clockid_t clock, timespec* time) {
  if (clock == CLOCK_THREAD_CPUTIME_ID && worker() != nullptr) {
    const mauve::Nanoseconds used = worker()->simulated.executed;
    time->tv_sec = used / 1000000000;
    time->tv_nsec = used % 1000000000;
    return 0;
  }
  return static_cast<int>(syscall(SYS_clock_gettime, clock, time));
}

int getrusage(__rusage_who_t who, rusage* usage) noexcept {
  const int result = static_cast<int>(syscall(SYS_getrusage, who, usage));
  if (result == 0 && worker() != nullptr) usage->ru_nvcsw = 0;
  return result;
}

int sched_getparam(pid_t thread, sched_param* parameter) noexcept {
  if (thread == 0 && worker() != nullptr) {
    parameter->sched_priority = worker()->scheduling.priority;
    return 0;
  }
  return static_cast<int>(syscall(SYS_sched_getparam, thread, parameter));
}

int sched_getaffinity(pid_t thread, std::size_t size, cpu_set_t* set) noexcept {
  if (thread == 0 && worker() != nullptr) {
    CPU_ZERO_S(size, set);
    const mauve::Cpus& cpus = worker()->scheduling.cpus;
    for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
      if (cpus[cpu]) CPU_SET_S(cpu, size, set);
    }
    return 0;
  }
  return syscall(SYS_sched_getaffinity, thread, size, set) < 0 ? -1 : 0;
}
}
