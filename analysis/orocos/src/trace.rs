//! The tracing of a package: spans of its components, programs and codels, recorded by LTTng-UST.
//!
//! With the option `MAUVE_TRACING` every step of a component, every program and every codel is an event where it begins
//! (`phase` 0) and one where it ends (`phase` 1), with the CPU time that its thread has used so far: the difference is an
//! execution time that no preemption is in. Without the option the macros of the header leave nothing behind.
//!
//! **One provider per package**, `mauve_<package>`: several packages are loaded into one deployer, and LTTng-UST has no
//! place for two providers of one name in a process. Up to 2.10 it aborts ("Duplicate registration"), and since 2.11 each
//! package's events count as definitions of the same ones, and everything is recorded once for each of them (seen with
//! 2.13). `lttng enable-event -u 'mauve*'` enables them all.
//!
//! **The header knows no LTTng**, whose headers define macros such as `tracepoint`, which a model may use as names. The
//! functions of the provider also keep a span that nobody records cheap: a call and a branch, and no clock is read (1 ns,
//! where a recorded event takes 500, 370 of them for the clock of a thread's CPU time).
//!
//! **What is counted.** The clock is the last thing that is read before a beginning is recorded, and the first when it
//! ends: a span counts about 500 ns of its own tracing, and 1 µs for each span inside of it. So times are rather too long
//! than too short.
//!
//! **Scheduling.** The begin of a period has the real-time priority of its thread and the CPUs that the thread may use, as the
//! kernel has them at that time: two system calls, only where a session records the event, and before the clock is read. (The
//! C library keeps a copy of the priority, which misses changes by other programs such as `chrt`.)
//!
//! **Balance.** A span whose beginning nobody recorded does not record its end, and one that an exception leaves does: so
//! begins and ends are brackets in each thread. Two things break them: a session that ends before a span does leaves a
//! beginning without an end at the end of its trace, and one that starts within a span that another session already
//! records sees an end without a beginning at its start. (Lost events do too; `babeltrace2` says where.)
//!
//! **No text is empty**: babeltrace2 up to 2.0.4 shows the text of an earlier event in its place. A program that has no
//! state or no transition has `-` there.
//!
//! Works with LTTng-UST 2.7 and later: it had no enumerations, so a phase is a number, and no macros with `LTTNG_UST_`, and
//! later versions still know those without.

use mauve_hir::{Decl, ModelDb, ProgramId};

use crate::escape::cpp_string;
use crate::generated_file::GeneratedFile;
use crate::library::Library;

/// Returns the header, the events and their provider; none for a library without components.
pub(crate) fn trace_files(library: &Library<'_>) -> Vec<GeneratedFile> {
    if library.components.is_empty() {
        return Vec::new();
    }
    let files = [
        ("include/{lib}/{lib}-trace.hpp", HEADER),
        ("tracing/{lib}-tp.h", EVENTS),
        ("tracing/{lib}-tp.c", PROVIDER),
    ];
    files.map(|(path, template)| GeneratedFile::from_template(&library.package, path, template)).into()
}

/// Returns the name of a codel in a trace, as a C++ literal.
pub(crate) fn codel_key(db: &dyn ModelDb, codel: Decl<'_>) -> String {
    cpp_string(&codel.qualified(db))
}

/// Returns the names of a program in a trace, as C++ literals: component, state, transition and program.
pub(crate) fn program_key(db: &dyn ModelDb, component: Decl<'_>, program: &ProgramId) -> String {
    let [state, transition, program] = span_of(program).map(cpp_string);
    format!("{}, {state}, {transition}, {program}", cpp_string(&component.qualified(db)))
}

fn span_of(program: &ProgramId) -> [&str; 3] {
    match program {
        ProgramId::Hook(kind) => ["", "", kind.keyword()],
        ProgramId::Operation(name) => ["", name, "operation"],
        ProgramId::Method { state, kind } => [state, "", kind.keyword()],
        ProgramId::Guard { state, transition } => [state, transition, "guard"],
        ProgramId::Effect { state, transition } => [state, transition, "effect"],
    }
}

const HEADER: &str = r#"// {generated}
//
// Spans of components, programs and codels, recorded by LTTng-UST if MAUVE_TRACING is defined.
// Without Orocos, MAUVE's own runtime (MAUVE_RUNTIME) measures programs and codels, too.
// Otherwise the macros expand to nothing.

#pragma once

#ifdef MAUVE_RUNTIME

#include <mauve/execution.hpp>

#define MAUVE_EXECUTE_PROGRAM(component, state, transition, program) \
  const ::mauve::ProgramExecution mauve_program_execution(component, state, transition, program)
#define MAUVE_EXECUTE_CODEL(codel, ...) \
  ::mauve::execute_codel(codel, [&] { return __VA_ARGS__; })

#else

#define MAUVE_EXECUTE_PROGRAM(component, state, transition, program) static_cast<void>(0)
#define MAUVE_EXECUTE_CODEL(codel, ...) (__VA_ARGS__)

#endif

#ifdef MAUVE_TRACING

#include <string>

extern "C" {
// Each records the begin (phase 0) or the end (phase 1) of a span. Returns false if no session
// records this event.
bool mauve_{lib}_component(const char* instance, int phase);
bool mauve_{lib}_program(
    const char* instance, const char* component, const char* state, const char* transition,
    const char* program, int phase);
bool mauve_{lib}_codel(const char* instance, const char* codel, int phase);
}

namespace {lib} {
namespace trace {

// A span begins with its constructor and ends with its destructor, also when an exception is thrown.
// Its end is recorded only if its begin was.

class ComponentSpan {
 public:
  explicit ComponentSpan(const std::string& instance) : instance_(instance.c_str()) {
    is_recorded_ = mauve_{lib}_component(instance_, 0);
  }
  ~ComponentSpan() {
    if (is_recorded_) mauve_{lib}_component(instance_, 1);
  }
  ComponentSpan(const ComponentSpan&) = delete;
  ComponentSpan& operator=(const ComponentSpan&) = delete;

 private:
  const char* instance_;
  bool is_recorded_;
};

class ProgramSpan {
 public:
  ProgramSpan(const std::string& instance, const char* component, const char* state,
              const char* transition, const char* program)
      : instance_(instance.c_str()),
        component_(component),
        state_(state),
        transition_(transition),
        program_(program) {
    is_recorded_ = record(0);
  }
  ~ProgramSpan() {
    if (is_recorded_) record(1);
  }
  ProgramSpan(const ProgramSpan&) = delete;
  ProgramSpan& operator=(const ProgramSpan&) = delete;

 private:
  bool record(int phase) const {
    return mauve_{lib}_program(instance_, component_, state_, transition_, program_, phase);
  }

  const char* instance_;
  const char* component_;
  const char* state_;
  const char* transition_;
  const char* program_;
  bool is_recorded_;
};

class CodelSpan {
 public:
  CodelSpan(const std::string& instance, const char* codel)
      : instance_(instance.c_str()), codel_(codel) {
    is_recorded_ = mauve_{lib}_codel(instance_, codel_, 0);
  }
  ~CodelSpan() {
    if (is_recorded_) mauve_{lib}_codel(instance_, codel_, 1);
  }
  CodelSpan(const CodelSpan&) = delete;
  CodelSpan& operator=(const CodelSpan&) = delete;

 private:
  const char* instance_;
  const char* codel_;
  bool is_recorded_;
};

// Returns the result of a call, in a span.
template <typename Call>
auto traced(const std::string& instance, const char* codel, Call call) -> decltype(call()) {
  const CodelSpan span(instance, codel);
  return call();
}

}  // namespace trace
}  // namespace {lib}

// Macros use this alias, since a macro parameter could have the name of the package.
namespace mauve_trace = ::{lib}::trace;

#define MAUVE_TRACE_COMPONENT(instance) \
  const ::mauve_trace::ComponentSpan mauve_component_span(instance)
#define MAUVE_TRACE_PROGRAM(instance, component, state, transition, program) \
  const ::mauve_trace::ProgramSpan mauve_program_span( \
      instance, component, state, transition, program); \
  MAUVE_EXECUTE_PROGRAM(component, state, transition, program)
#define MAUVE_TRACE_CODEL(instance, codel, ...) \
  ::mauve_trace::traced(instance, codel, [&] { return MAUVE_EXECUTE_CODEL(codel, __VA_ARGS__); })

#else

#define MAUVE_TRACE_COMPONENT(instance) static_cast<void>(0)
#define MAUVE_TRACE_PROGRAM(instance, component, state, transition, program) \
  MAUVE_EXECUTE_PROGRAM(component, state, transition, program)
#define MAUVE_TRACE_CODEL(instance, codel, ...) MAUVE_EXECUTE_CODEL(codel, __VA_ARGS__)

#endif
"#;

const EVENTS: &str = r#"// {generated}
//
// The events of LTTng-UST, each at the begin (phase 0) and at the end (phase 1) of a span.
// cpu_ns is the CPU time that the thread has used so far, without the time in which it was preempted.

#undef TRACEPOINT_PROVIDER
#define TRACEPOINT_PROVIDER mauve_{lib}

#undef TRACEPOINT_INCLUDE
#define TRACEPOINT_INCLUDE "./{lib}-tp.h"

#if !defined(MAUVE_{lib}_TP_H) || defined(TRACEPOINT_HEADER_MULTI_READ)
#define MAUVE_{lib}_TP_H

#include <lttng/tracepoint.h>
#include <stdint.h>

// One period of a component. Its begin has the real-time priority of the thread, which is 0 without a
// real-time scheduler, and the CPUs that the thread may use, a bit each; -1 and 0 are unknown.
TRACEPOINT_EVENT(
    mauve_{lib}, component,
    TP_ARGS(const char*, instance, int, phase, uint64_t, cpu_ns, int, priority, uint64_t, cpus),
    TP_FIELDS(
        ctf_string(instance, instance)
        ctf_integer(uint8_t, phase, phase)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)
        ctf_integer(int32_t, priority, priority)
        ctf_integer(uint64_t, cpus, cpus)))

// A program of a component: of a state, of a transition, of an operation (then `transition` is the
// name of the operation), or of the component itself. "-" without a state or a transition.
TRACEPOINT_EVENT(
    mauve_{lib}, program,
    TP_ARGS(const char*, instance, const char*, component, const char*, state,
            const char*, transition, const char*, program, int, phase, uint64_t, cpu_ns),
    TP_FIELDS(
        ctf_string(instance, instance)
        ctf_string(component, component)
        ctf_string(state, state)
        ctf_string(transition, transition)
        ctf_string(program, program)
        ctf_integer(uint8_t, phase, phase)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)))

// A call of a codel.
TRACEPOINT_EVENT(
    mauve_{lib}, codel,
    TP_ARGS(const char*, instance, const char*, codel, int, phase, uint64_t, cpu_ns),
    TP_FIELDS(
        ctf_string(instance, instance)
        ctf_string(codel, codel)
        ctf_integer(uint8_t, phase, phase)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)))

#endif

#include <lttng/tracepoint-event.h>
"#;

const PROVIDER: &str = r#"// {generated}
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
"#;
