// What generated components say of their execution.

#ifndef MAUVE_EXECUTION_HPP
#define MAUVE_EXECUTION_HPP

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

}  // namespace mauve

#endif
