// Records the executions of codels in a file that `mauve pwcet` reads.

#ifndef MAUVE_TRACE_FILE_HPP
#define MAUVE_TRACE_FILE_HPP

#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "mauve/clock.hpp"
#include "queue.hpp"

namespace mauve {

// An execution of a codel. Its texts stay valid.
struct TraceRecord {
  const char* codel;
  const char* instance;
  // CPU time; time from its beginning to its end; the instant of its end.
  Nanoseconds execution, elapsed, ended;
};

// Where the threads of a robot put records.
class TraceQueue {
 public:
  TraceQueue() : records_(1 << 16) {}
  void push(const TraceRecord& record) {
    records_.put([&](TraceRecord& to) { to = record; });
  }

 private:
  friend class TraceFile;
  Queue<TraceRecord> records_;
};

// A folder with the file executions.csv, which has its name when it is complete.
class TraceFile {
 public:
  // Begins the file. `problem` says why it cannot be.
  TraceFile(const std::string& folder, std::string& problem);
  ~TraceFile();
  TraceQueue& queue() { return queue_; }
  // To be called now and then, by one thread.
  void write();
  // Completes the file. Returns what is wrong with it, or an empty text. A file that could not be written is removed.
  std::string finish();
  const std::string& path() const { return path_; }

 private:
  TraceQueue queue_;
  std::string path_, partial_;
  std::FILE* file_ = nullptr;
  int error_ = 0;
  std::vector<TraceRecord> taken_;
};

}  // namespace mauve

#endif
