// The table of response times beside their bounds.

#ifndef MAUVE_REPORT_HPP
#define MAUVE_REPORT_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "chains.hpp"
#include "context.hpp"
#include "mauve/clock.hpp"
#include "mauve/cpus.hpp"
#include "other_threads.hpp"

namespace mauve {

// An instance and its periods so far.
struct Row {
  std::string instance;
  // 0 in the background.
  int priority;
  // None: any.
  Cpus cpus;
  Nanoseconds period, deadline;
  // `no_bound` if there is none.
  Nanoseconds bound;
  std::uint64_t periods, misses, overruns;
  Nanoseconds latency, response;
  bool has_thrown;
};

// Returns the table, in lines that end with a newline.
std::string table(const std::vector<Row>& rows);

// What a codel was like in one instance.
struct CodelRow {
  // The index of its instance among the rows.
  std::size_t instance;
  CodelStatistics statistics;
  // Its time and its wait in the timing tables, or -1.
  Nanoseconds time, wait;
};

// What a port was like in one instance.
struct PortRow {
  std::size_t instance;
  PortStatistics statistics;
  // Its time in the timing tables, or -1.
  Nanoseconds time;
};

// What a run was like, apart from the response times.
struct Causes {
  std::vector<CodelRow> codels;
  std::vector<PortRow> ports;
  std::vector<Work> work;
  Nanoseconds length;
  // Where executions are recorded; empty where they are not.
  std::string trace_folder;
};

// The greatest latencies of chains, in lines that end with a newline; an empty text without any. `begin` is that of the run.
std::string table(const std::vector<ObservedChain>& chains, Nanoseconds begin);

// Says why instances were late, what a bound does not count, and what to write: lines that end with a newline.
std::string explanation(const std::vector<Row>& rows, const Causes& causes);

// Returns a time in milliseconds, to the microsecond.
std::string milliseconds(Nanoseconds time);

}  // namespace mauve

#endif
