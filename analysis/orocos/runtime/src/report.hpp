// The table of response times beside their bounds.

#ifndef MAUVE_REPORT_HPP
#define MAUVE_REPORT_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "mauve/clock.hpp"

namespace mauve {

// An instance and its periods so far.
struct Row {
  std::string instance;
  // 0 in the background.
  int priority;
  Nanoseconds period, deadline;
  // `no_bound` if there is none.
  Nanoseconds bound;
  std::uint64_t periods, misses, overruns;
  Nanoseconds latency, response;
  bool has_thrown;
};

// Returns the table, in lines that end with a newline.
std::string table(const std::vector<Row>& rows);

// Returns a time in milliseconds, to the microsecond.
std::string milliseconds(Nanoseconds time);

}  // namespace mauve

#endif
