// What the thread of an activity executes, for whoever measures it or simulates its time.

#ifndef MAUVE_CONTEXT_HPP
#define MAUVE_CONTEXT_HPP

#include <array>
#include <atomic>
#include <cstdint>
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
  // The time of a read or a write of a port.
  void add_access(const std::string& port, Nanoseconds time) { add({port, "", "", "access"}, time); }
  // That time, or -1.
  Nanoseconds access(const char* port) const { return find(port, "", "", "access"); }
  // The wait of a codel, or -1.
  void add_wait(const std::string& codel, Nanoseconds time) { add({codel, "", "", "wait"}, time); }
  Nanoseconds wait(const char* codel) const { return find(codel, "", "", "wait"); }
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

// What the executions of one codel in one thread were like.
struct CodelStatistics {
  const char* codel;
  // The greatest CPU time.
  Nanoseconds execution;
  // The executions that waited for something, and the greatest time that one of them was off the CPU. It may have been preempted, too.
  std::uint64_t waits;
  Nanoseconds wait;
  // How often one of them waited, at most.
  std::int64_t times;
  // The greatest time that one execution waited for locks.
  Nanoseconds blocked;
};

// The greatest time that reading or writing a port took: CPU time, or where executions are not recorded, elapsed time.
struct PortStatistics {
  const char* port;
  Nanoseconds greatest;
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
  // Where what chains need is put, if executions are not recorded.
  TraceQueue* followed = nullptr;
  std::string instance;
  // The codel that is being executed, if one is.
  std::atomic<const char*> codel{nullptr};
  // Whether a program with a time of its own is being executed: then its codels take none.
  bool is_timed_program = false;
  // The CPU time of the codels and the accesses of ports so far.
  Nanoseconds measured_cpu = 0;
  // How often the thread has waited by its own will so far, as far as that was read, without the waits for locks.
  std::int64_t waits = 0;
  // How often, and for how long, it has waited for locks: see mauve/lock.hpp.
  std::int64_t lock_waits = 0;
  Nanoseconds blocked = 0;
  // The CPU time in which it has recorded inputs so far: see mauve/inputs.hpp.
  Nanoseconds copied = 0;
  // Of the first codels and ports that it has used.
  std::array<CodelStatistics, 64> codels{};
  std::array<PortStatistics, 64> ports{};

  TraceQueue* queue() const { return trace != nullptr ? trace : followed; }
  void note(const char* name, Nanoseconds execution, Nanoseconds wait, std::int64_t wait_count, Nanoseconds waited_for_locks);
  void note_port(const char* name, Nanoseconds time);
};

// The context of the calling thread; none where it is that of no activity.
Context* present_context();
void set_present_context(Context* context);

// How often the calling thread has waited by its own will: for a device, a lock, a sleep, a page on the disk. A thread that is
// preempted does not.
std::int64_t voluntary_waits();

}  // namespace mauve

#endif
