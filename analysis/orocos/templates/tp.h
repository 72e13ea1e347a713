// {generated}
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

// A call of a codel. waits: how often the thread has given up the CPU by its own will so far, to wait for
// something. outcome: at the end, 6 if it returned false, 7 if it returned true; otherwise -1.
TRACEPOINT_EVENT(
    mauve_{lib}, codel,
    TP_ARGS(const char*, instance, const char*, codel, int, phase, uint64_t, cpu_ns, uint64_t, waits,
            int, outcome),
    TP_FIELDS(
        ctf_string(instance, instance)
        ctf_string(codel, codel)
        ctf_integer(uint8_t, phase, phase)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)
        ctf_integer(uint64_t, waits, waits)
        ctf_integer(int8_t, outcome, outcome)))

// A read or a write of a port, named by its component and its own name. outcome: at the end, 0 for no data,
// 1 for old data, 2 for new data; 3 for written, 4 for lost in a full buffer, 5 for unconnected; otherwise -1.
TRACEPOINT_EVENT(
    mauve_{lib}, access,
    TP_ARGS(const char*, instance, const char*, port, int, phase, uint64_t, cpu_ns, int, outcome),
    TP_FIELDS(
        ctf_string(instance, instance)
        ctf_string(port, port)
        ctf_integer(uint8_t, phase, phase)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)
        ctf_integer(int8_t, outcome, outcome)))

// A lock that a thread leaves, with the CPU time and the time for which the thread had it, how often the
// thread gave up the CPU to get it, and for how long it waited. One event has both ends (phase 1), since
// locks may be left in any order.
TRACEPOINT_EVENT(
    mauve_{lib}, lock,
    TP_ARGS(const char*, lock, uint64_t, cpu_ns, uint64_t, elapsed_ns, uint64_t, blocked_ns,
            uint64_t, waits),
    TP_FIELDS(
        ctf_string(instance, "-")
        ctf_string(lock, lock)
        ctf_integer(uint8_t, phase, 1)
        ctf_integer(uint64_t, cpu_ns, cpu_ns)
        ctf_integer(uint64_t, elapsed_ns, elapsed_ns)
        ctf_integer(uint64_t, blocked_ns, blocked_ns)
        ctf_integer(uint64_t, waits, waits)))

#endif

#include <lttng/tracepoint-event.h>
