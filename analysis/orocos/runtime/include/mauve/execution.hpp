// What generated components say of their execution.

#ifndef MAUVE_EXECUTION_HPP
#define MAUVE_EXECUTION_HPP

#include <cstdint>
#include <type_traits>

#include "mauve/clock.hpp"

namespace mauve {

// The thread of an activity, as far as the code that it executes is concerned: see src/context.hpp.
struct Context;

// A codel is executed while one of these exists. All texts must stay valid.
class CodelExecution {
 public:
  explicit CodelExecution(const char* codel);
  ~CodelExecution();
  CodelExecution(const CodelExecution&) = delete;
  CodelExecution& operator=(const CodelExecution&) = delete;

 private:
  // Nothing where the thread is that of no activity.
  Context* const context_;
  const char* const codel_;
  const char* outer_ = nullptr;
  Nanoseconds began_ = 0;
  Nanoseconds cpu_before_ = 0;
  // See src/context.hpp.
  Nanoseconds blocked_before_ = 0;
  std::int64_t waits_before_ = 0;
};

// A port is read or written while one of these exists.
class PortAccess {
 public:
  // Unless executions are recorded, nothing is measured where the copy takes less than that would: `is_small`.
  PortAccess(const char* port, bool is_small);
  ~PortAccess();
  PortAccess(const PortAccess&) = delete;
  PortAccess& operator=(const PortAccess&) = delete;

 private:
  // Nothing where nothing is measured.
  Context* context_;
  const char* const port_;
  // The time of the timing tables; -1 without one.
  Nanoseconds time_ = -1;
  Nanoseconds began_ = 0;
  Nanoseconds cpu_before_ = 0;
};

// A program is executed while one of these exists.
class ProgramExecution {
 public:
  ProgramExecution(const char* component, const char* state, const char* transition, const char* program);
  ~ProgramExecution();
  ProgramExecution(const ProgramExecution&) = delete;
  ProgramExecution& operator=(const ProgramExecution&) = delete;

 private:
  // Nothing where the thread is that of no activity.
  Context* const context_;
  const char *const component_, *const state_, *const transition_, *const program_;
  // The time of its own; -1 without one.
  Nanoseconds time_ = -1;
  Nanoseconds began_ = 0;
  Nanoseconds cpu_before_ = 0;
};

// Returns the result of a call of a codel.
template <class Call>
auto execute_codel(const char* codel, Call call) -> decltype(call()) {
  const CodelExecution execution(codel);
  return call();
}

// Whether a copy takes about as long as reading a clock.
template <class Sample>
constexpr bool is_small() {
  return std::is_trivially_copyable<Sample>::value && sizeof(Sample) <= 256;
}

// Reads a port. `key` names it in a timing table.
template <class Port, class Sample>
auto read_port(const char* key, Port& port, Sample& sample) -> decltype(port.read(sample)) {
  const PortAccess access(key, is_small<Sample>());
  return port.read(sample);
}

// Writes a port. What computes the value is no part of it.
template <class Port, class Sample>
void write_port(const char* key, Port& port, const Sample& sample) {
  const PortAccess access(key, is_small<Sample>());
  port.write(sample);
}

}  // namespace mauve

#endif
