// {generated}
//
// The tracepoint provider of LTTng-UST, called by {lib}-trace.hpp.

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif

#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/resource.h>
#include <time.h>

#define TRACEPOINT_CREATE_PROBES
#define TRACEPOINT_DEFINE
#include "{lib}-tp.h"

// The CPU time that this thread has used so far.
static uint64_t cpu_ns(void) {
  struct timespec used;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return (uint64_t)used.tv_sec * 1000000000u + (uint64_t)used.tv_nsec;
}

// How often this thread has given up the CPU by its own will so far. A preempted thread does not.
static uint64_t waits(void) {
  struct rusage usage;
  return getrusage(RUSAGE_THREAD, &usage) == 0 ? (uint64_t)usage.ru_nvcsw : 0;
}

// The real-time priority of this thread: 0 with another scheduler, -1 if it is unknown.
static int priority(void) {
  struct sched_param parameter;
  return sched_getparam(0, &parameter) == 0 ? parameter.sched_priority : -1;
}

// The CPUs that this thread may use, of the first 64: 0 if they are unknown.
static uint64_t cpus(void) {
  cpu_set_t set;
  uint64_t mask = 0;
  int cpu;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 0;
  for (cpu = 0; cpu < 64; ++cpu) {
    if (CPU_ISSET(cpu, &set)) mask |= (uint64_t)1 << cpu;
  }
  return mask;
}

// babeltrace2 up to 2.0.4 reads an empty string as a string of an earlier event.
static const char* or_dash(const char* name) { return *name ? name : "-"; }

// The clock is read last at the begin and first at the end of a span, and only if a session records
// the event.

bool mauve_{lib}_component(const char* instance, int phase) {
  if (!tracepoint_enabled(mauve_{lib}, component)) return false;
  if (phase == 0) {
    const int priority_now = priority();
    const uint64_t cpus_now = cpus();
    do_tracepoint(mauve_{lib}, component, instance, phase, cpu_ns(), priority_now, cpus_now);
  } else {
    do_tracepoint(mauve_{lib}, component, instance, phase, cpu_ns(), -1, 0);
  }
  return true;
}

bool mauve_{lib}_program(
    const char* instance, const char* component, const char* state, const char* transition,
    const char* program, int phase) {
  if (!tracepoint_enabled(mauve_{lib}, program)) return false;
  do_tracepoint(mauve_{lib}, program, instance, component, or_dash(state), or_dash(transition),
                program, phase, cpu_ns());
  return true;
}

bool mauve_{lib}_codel(const char* instance, const char* codel, int phase, int outcome) {
  if (!tracepoint_enabled(mauve_{lib}, codel)) return false;
  // The arguments of a call have no order: this system call is in no execution time.
  if (phase == 0) {
    const uint64_t waits_before = waits();
    do_tracepoint(mauve_{lib}, codel, instance, codel, phase, cpu_ns(), waits_before, outcome);
  } else {
    const uint64_t cpu_after = cpu_ns();
    do_tracepoint(mauve_{lib}, codel, instance, codel, phase, cpu_after, waits(), outcome);
  }
  return true;
}

bool mauve_{lib}_access(const char* instance, const char* port, int phase, int outcome) {
  if (!tracepoint_enabled(mauve_{lib}, access)) return false;
  do_tracepoint(mauve_{lib}, access, instance, port, phase, cpu_ns(), outcome);
  return true;
}

bool mauve_{lib}_records_locks(void) { return tracepoint_enabled(mauve_{lib}, lock); }

uint64_t mauve_{lib}_waits(void) { return waits(); }

void mauve_{lib}_lock(const char* lock, uint64_t cpu, uint64_t elapsed_ns, uint64_t blocked_ns,
                      uint64_t waits_for_it) {
  do_tracepoint(mauve_{lib}, lock, lock, cpu, elapsed_ns, blocked_ns, waits_for_it);
}
