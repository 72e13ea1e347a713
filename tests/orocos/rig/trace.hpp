// Stands in for the trace points of a generated package: they say what they would record.

#ifndef RIG_TRACE_HPP
#define RIG_TRACE_HPP

#include "recorder.hpp"

#define RIG_JOIN2(x, y) x##y
#define RIG_JOIN(x, y) RIG_JOIN2(x, y)

#define MAUVE_TRACE_COMPONENT(instance) \
  const ::rig::Span RIG_JOIN(rig_span_, __LINE__)(std::string("component ") + (instance), true)

#define MAUVE_TRACE_PROGRAM(instance, component, state, transition, program)                              \
  const ::rig::Span RIG_JOIN(rig_span_, __LINE__)(                                                        \
      (instance) + " " + (component) + ": " + ::rig::join({program, state, transition}), true)

#define MAUVE_TRACE_CODEL(instance, codel, call) \
  (::rig::Span((instance) + " codel " + (codel), false), call)

#define MAUVE_TRACE_READ(instance, key, port, sample) (port).read(sample)
#define MAUVE_TRACE_WRITE(instance, key, port, ...) (port).write(__VA_ARGS__)

#endif
