// {generated}
//
// Spans of components, programs, codels and accesses of ports, recorded by LTTng-UST if MAUVE_TRACING is
// defined. Without Orocos, MAUVE's own runtime (MAUVE_RUNTIME) measures them, too.
// Otherwise the macros expand to nothing.

#pragma once

#ifdef MAUVE_RUNTIME

#include <mauve/execution.hpp>

#define MAUVE_EXECUTE_PROGRAM(component, state, transition, program) \
  const ::mauve::ProgramExecution mauve_program_execution(component, state, transition, program)
#define MAUVE_EXECUTE_CODEL(codel, ...) \
  ::mauve::execute_codel(codel, [&] { return __VA_ARGS__; })
#define MAUVE_EXECUTE_READ(key, port, sample) ::mauve::read_port(key, port, sample)
#define MAUVE_EXECUTE_WRITE(key, port, ...) ::mauve::write_port(key, port, __VA_ARGS__)

#else

#define MAUVE_EXECUTE_PROGRAM(component, state, transition, program) static_cast<void>(0)
#define MAUVE_EXECUTE_CODEL(codel, ...) (__VA_ARGS__)
#define MAUVE_EXECUTE_READ(key, port, sample) (port).read(sample)
#define MAUVE_EXECUTE_WRITE(key, port, ...) (port).write(__VA_ARGS__)

#endif

#ifdef MAUVE_TRACING

#include <string>
#include <type_traits>

extern "C" {
// Each records the begin (phase 0) or the end (phase 1) of a span. Returns false if no session
// records this event.
bool mauve_{lib}_component(const char* instance, int phase);
bool mauve_{lib}_program(
    const char* instance, const char* component, const char* state, const char* transition,
    const char* program, int phase);
bool mauve_{lib}_codel(const char* instance, const char* codel, int phase, int outcome);
bool mauve_{lib}_access(const char* instance, const char* port, int phase, int outcome);
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
    is_recorded_ = mauve_{lib}_codel(instance_, codel_, 0, -1);
  }
  ~CodelSpan() {
    if (is_recorded_) mauve_{lib}_codel(instance_, codel_, 1, outcome_);
  }
  CodelSpan(const CodelSpan&) = delete;
  CodelSpan& operator=(const CodelSpan&) = delete;

  // Returns the result of a call, and notes a bool.
  template <typename Call>
  bool result_of(Call& call, std::true_type) {
    const bool result = call();
    outcome_ = result ? 7 : 6;
    return result;
  }
  template <typename Call>
  auto result_of(Call& call, std::false_type) -> decltype(call()) {
    return call();
  }

 private:
  const char* instance_;
  const char* codel_;
  int outcome_ = -1;
  bool is_recorded_;
};

class AccessSpan {
 public:
  AccessSpan(const std::string& instance, const char* port)
      : instance_(instance.c_str()), port_(port) {
    is_recorded_ = mauve_{lib}_access(instance_, port_, 0, -1);
  }
  ~AccessSpan() {
    if (is_recorded_) mauve_{lib}_access(instance_, port_, 1, outcome);
  }
  AccessSpan(const AccessSpan&) = delete;
  AccessSpan& operator=(const AccessSpan&) = delete;

  int outcome = -1;

 private:
  const char* instance_;
  const char* port_;
  bool is_recorded_;
};

// Returns the result of a call, in a span.
template <typename Call>
auto traced(const std::string& instance, const char* codel, Call call) -> decltype(call()) {
  CodelSpan span(instance, codel);
  return span.result_of(call, std::is_same<decltype(call()), bool>());
}

// Reads or writes a port, in a span. What computes the value to write is no part of it.
template <typename Port, typename Sample>
auto read(const std::string& instance, const char* key, Port& port, Sample& sample)
    -> decltype(port.read(sample)) {
  AccessSpan span(instance, key);
  const auto status = MAUVE_EXECUTE_READ(key, port, sample);
  span.outcome = static_cast<int>(status);
  return status;
}

// Returns what a write came to. RTT 2.8 does not say it.
template <typename Write>
auto outcome_of(Write write) -> typename std::enable_if<std::is_void<decltype(write())>::value, int>::type {
  write();
  return 3;
}

template <typename Write>
auto outcome_of(Write write) -> typename std::enable_if<!std::is_void<decltype(write())>::value, int>::type {
  return 3 + static_cast<int>(write());
}

template <typename Port, typename Sample>
void write(const std::string& instance, const char* key, Port& port, const Sample& sample) {
  AccessSpan span(instance, key);
  span.outcome = outcome_of([&] { return MAUVE_EXECUTE_WRITE(key, port, sample); });
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
#define MAUVE_TRACE_READ(instance, key, port, sample) \
  mauve_read(port, ::mauve_trace::read(instance, key, port, sample))
#define MAUVE_TRACE_WRITE(instance, key, port, ...) \
  ::mauve_trace::write(instance, key, port, __VA_ARGS__)

#else

#define MAUVE_TRACE_COMPONENT(instance) static_cast<void>(0)
#define MAUVE_TRACE_PROGRAM(instance, component, state, transition, program) \
  MAUVE_EXECUTE_PROGRAM(component, state, transition, program)
#define MAUVE_TRACE_CODEL(instance, codel, ...) MAUVE_EXECUTE_CODEL(codel, __VA_ARGS__)
#define MAUVE_TRACE_READ(instance, key, port, sample) mauve_read(port, MAUVE_EXECUTE_READ(key, port, sample))
#define MAUVE_TRACE_WRITE(instance, key, port, ...) MAUVE_EXECUTE_WRITE(key, port, __VA_ARGS__)

#endif
