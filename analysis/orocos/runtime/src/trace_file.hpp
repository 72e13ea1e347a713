// Records executions of codels, programs and periods in files that `mauve trace` reads.

#ifndef MAUVE_TRACE_FILE_HPP
#define MAUVE_TRACE_FILE_HPP

#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "mauve/clock.hpp"
#include "mauve/execution.hpp"
#include "queue.hpp"

namespace mauve {

// An execution. Its texts stay valid.
struct TraceRecord {
  enum Kind { Codel, Program, Period, Access, Lock };
  Kind kind;
  const char* instance;
  // CPU time; time from its beginning to its end; the instant of its end.
  Nanoseconds execution, elapsed, ended;
  // The name of the codel or the port; the component, state, transition and kind of the program; or the name of the lock, and in
  // `program` the codel that held it.
  const char *name, *state, *transition, *program;
  // Of a period: its release, the real-time priority of its thread, the CPUs that the thread may use, the CPU where it began, and the
  // CPU time since the end of the period before without codels and ports; -1 where they are unknown.
  Nanoseconds release;
  int priority;
  std::int64_t cpus;
  int cpu;
  Nanoseconds overhead;
  // Of a codel: how often its thread waited by its own will, without the waits for locks, -1 where that is unknown; and for how
  // long it waited for locks.
  std::int64_t waits;
  Nanoseconds blocked;
  // Of a codel and of an access of a port.
  Outcome outcome;
  // Of an access: the number of the sample, among those that its port has written; 0 without one.
  std::uint64_t number;

  static TraceRecord of(Kind kind, const char* instance, const char* name, Nanoseconds execution, Nanoseconds began,
                        Nanoseconds ended) {
    return {kind, instance, execution, ended - began, ended, name, "", "", "", -1, -1, -1, -1, -1, -1, 0, Outcome::Unknown, 0};
  }
};

// Where the threads of a robot put records.
class TraceQueue {
 public:
  TraceQueue() : records_(1 << 16) { taken_.reserve(1 << 16); }
  void push(const TraceRecord& record) {
    records_.put([&](TraceRecord& to) { to = record; });
  }
  // By one thread: what was put since the last call, about in the order of time. It stays until the next call.
  const std::vector<TraceRecord>& take();
  // How many records found no place.
  std::uint64_t lost() const { return records_.lost(); }

 private:
  Queue<TraceRecord> records_;
  std::vector<TraceRecord> taken_;
};

// A folder with the files executions.csv and periods.csv, which have their names when they are complete.
class TraceFile {
 public:
  // Begins the files. `problem` says why they cannot be. If the execution times are those of timing tables, executions.csv says so:
  // nobody may take them for measured ones.
  // It also says with which compiler and flags the program was built, if `build` does: with others, times are others.
  TraceFile(const std::string& folder, const std::string& build, bool is_from_tables, std::string& problem);
  ~TraceFile();
  // By one thread. `lost` is the number of records that are missing so far.
  void write(const std::vector<TraceRecord>& records, std::uint64_t lost);
  // Before `finish`: the CPU time that threads of this name, which are no activities, used within this time.
  void work(const std::string& name, Nanoseconds cpu, Nanoseconds elapsed);
  // Writes another file beside them. Returns what is wrong with it, or an empty text.
  std::string put(const std::string& name, const std::string& text);
  // Completes the files. Returns what is wrong with them, or an empty text. What was written of files that could not be completed stays.
  std::string finish();

 private:
  struct File {
    std::string path, partial;
    std::FILE* file = nullptr;
  };

  bool begin(File& to, const std::string& path, const char* header, std::string& problem);
  // Why a file cannot be begun that is there.
  std::string is_taken(const std::string& partial) const;
  bool write(const TraceRecord& record);
  void remove();

  // The folder, in which the paths of files are, and as messages show it.
  int folder_ = -1;
  std::string shown_;
  File executions_, periods_;
  int error_ = 0;
  // The number of the next line, of both files; and of the records that were lost so far.
  std::uint64_t order_ = 0, lost_ = 0;
};

}  // namespace mauve

#endif
