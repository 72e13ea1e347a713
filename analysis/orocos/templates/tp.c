// {generated}
//
// The tracepoint provider of LTTng-UST, called by {lib}-trace.hpp.

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif

#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
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

bool mauve_{lib}_codel(const char* instance, const char* codel, int phase) {
  if (!tracepoint_enabled(mauve_{lib}, codel)) return false;
  do_tracepoint(mauve_{lib}, codel, instance, codel, phase, cpu_ns());
  return true;
}
