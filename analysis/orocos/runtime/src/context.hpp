// What the thread of an activity executes, for whoever measures it or simulates its time.

#ifndef MAUVE_CONTEXT_HPP
#define MAUVE_CONTEXT_HPP

#include <atomic>
#include <string>
#include <vector>

#include "mauve/execution.hpp"
#include "trace_file.hpp"

namespace mauve {

struct Worker;

// Execution times by keys. Looking one up neither locks nor allocates.
class ExecutionTimes {
 public:
  void add(const std::string& codel, Nanoseconds time) { add({codel, "", "", ""}, time); }
  void add(const std::string& component, const std::string& state, const std::string& transition,
           const std::string& program, Nanoseconds time) {
    add({component, state, transition, program}, time);
  }
  // The time of a codel, or -1.
  Nanoseconds codel(const char* codel) const { return find(codel, "", "", ""); }
  // The time of a program that the tables have an entry for, or -1.
  Nanoseconds program(const char* component, const char* state, const char* transition, const char* program) const {
    return find(component, state, transition, program);
  }

 private:
  struct Key {
    std::string component, state, transition, program;
  };
  struct Entry {
    Key key;
    Nanoseconds time;
  };
  void add(Key key, Nanoseconds time);
  Nanoseconds find(const char* component, const char* state, const char* transition, const char* program) const;

  // In the order of the keys.
  std::vector<Entry> entries_;
};

// Of one thread, which alone uses it while it runs, except for `codel`.
struct Context {
  Worker* worker = nullptr;
  // Where codels and programs take their times from: on a virtual clock, and in threads that spend time. Otherwise none.
  const ExecutionTimes* times = nullptr;
  // The part of each time that is spent in real time, in percent.
  int spent_percent = 0;
  // Where executions are recorded, if they are.
  TraceQueue* trace = nullptr;
  std::string instance;
  // The codel that is being executed, if one is.
  std::atomic<const char*> codel{nullptr};
  // Whether a program with a time of its own is being executed: then its codels take none.
  bool is_timed_program = false;
  // The CPU time of the codels so far.
  Nanoseconds codel_cpu = 0;
};

// The context of the calling thread; none where it is that of no activity.
Context* present_context();
void set_present_context(Context* context);

}  // namespace mauve

#endif
