// The command line of a robot's program.

#ifndef MAUVE_OPTIONS_HPP
#define MAUVE_OPTIONS_HPP

#include <string>
#include <vector>

#include "mauve/clock.hpp"
#include "rtt/Logger.hpp"

namespace mauve {

struct Parameter {
  std::string instance, property, value;
};

struct Options {
  // `never`: until the program is interrupted.
  Nanoseconds length = never;
  std::vector<Parameter> parameters;
  bool simulates_time = false;
  bool spends_times = false;
  bool allows_non_realtime = false;
  bool is_live = false;
  // Empty: nothing is recorded.
  std::string trace_folder;
  // With that folder: also the inputs of codels, which the program copies.
  bool records_inputs = false;
  RTT::LogLevel log_level = RTT::Warning;
};

// Reads the command line of a program. Returns whether it should run; otherwise `exit_code` says how it ends.
bool read_options(int argc, char** argv, const std::string& deployment, Options& options, int& exit_code);

// Reads a time such as `10s` or `1.5 min`. False if the text is none, or too long.
bool read_time(const std::string& text, Nanoseconds& time);

}  // namespace mauve

#endif
