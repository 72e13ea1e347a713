// What generated components say of their execution.

#ifndef MAUVE_EXECUTION_HPP
#define MAUVE_EXECUTION_HPP

#include <cstdint>
#include <type_traits>

#include "mauve/clock.hpp"

namespace mauve {

// The thread of an activity, as far as the code that it executes is concerned: see src/context.hpp.
struct Context;

// What an execution came to: a read, in the order of RTT::FlowStatus; a write, in that of RTT::WriteStatus; the result of a codel.
enum class Outcome { Unknown = -1, NoData, OldData, NewData, Written, Lost, Unconnected, False, True };

// A codel is executed while one of these exists. All texts must stay valid.
class CodelExecution {
 public:
  explicit CodelExecution(const char* codel);
  ~CodelExecution();
  CodelExecution(const CodelExecution&) = delete;
  CodelExecution& operator=(const CodelExecution&) = delete;

  template <class Call>
  bool result_of(Call& call, std::true_type) {
    const bool result = call();
    outcome_ = result ? Outcome::True : Outcome::False;
    return result;
  }
  template <class Call>
  auto result_of(Call& call, std::false_type) -> decltype(call()) {
    return call();
  }

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
  Nanoseconds copied_before_ = 0;
  Outcome outcome_ = Outcome::Unknown;
};

// A port is read or written while one of these exists.
class PortAccess {
 public:
  // Unless executions are recorded or followed, nothing is measured where the copy takes less than that would: `is_small`.
  PortAccess(const char* port, bool is_small);
  ~PortAccess();
  PortAccess(const PortAccess&) = delete;
  PortAccess& operator=(const PortAccess&) = delete;

  // `number` is that of the sample among those that its port has written.
  void end(Outcome outcome, std::uint64_t number) {
    outcome_ = outcome;
    number_ = number;
  }
  // There was nothing to access.
  void cancel() { context_ = nullptr; }

 private:
  // Nothing where nothing is measured.
  Context* context_;
  const char* const port_;
  bool is_measured_ = true;
  Outcome outcome_ = Outcome::Unknown;
  std::uint64_t number_ = 0;
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
  CodelExecution execution(codel);
  return execution.result_of(call, std::is_same<decltype(call()), bool>());
}

// Whether a copy takes about as long as reading a clock.
template <class Sample>
constexpr bool is_small() {
  return std::is_trivially_copyable<Sample>::value && sizeof(Sample) <= 256;
}

// Reads a port. `key` names it in a timing table.
template <class Port, class Sample>
auto read_port(const char* key, Port& port, Sample& sample) -> decltype(port.read(sample)) {
  PortAccess access(key, is_small<Sample>());
  const auto status = port.read(sample);
  access.end(static_cast<Outcome>(status), port.number());
  return status;
}

// Writes a port. What computes the value is no part of it.
template <class Port, class Sample>
auto write_port(const char* key, Port& port, const Sample& sample) -> decltype(port.write(sample)) {
  PortAccess access(key, is_small<Sample>());
  const auto status = port.write(sample);
  access.end(static_cast<Outcome>(static_cast<int>(Outcome::Written) + static_cast<int>(status)), port.number());
  return status;
}

}  // namespace mauve

#endif
