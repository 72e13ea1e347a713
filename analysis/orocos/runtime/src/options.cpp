#include "options.hpp"

#include <iostream>
#include <locale>
#include <sstream>

namespace mauve {
namespace {

const char usage[] =
    "  --for TIME                  stop after this time, such as 10s or 500ms; by default when interrupted\n"
    "  --param INSTANCE.NAME=VALUE set a property; may be given several times\n"
    "  --simulate-time             run on a virtual clock, as fast as possible, with the execution times of the timing tables\n"
    "  --spend-times               for codels that are stubs: each uses the CPU for four fifths of its execution time\n"
    "  --allow-non-realtime        run without the scheduling that was analysed; the response times do not hold then\n"
    "  --trace DIR                 record executions, accesses of ports and locks in DIR/executions.csv,\n"
    "                              and periods in DIR/periods.csv\n"
    "  --inputs                    with --trace: record inputs of codels in DIR/inputs.toml\n"
    "  --live                      show the response times while the robot runs, on a terminal\n"
    "  --log-level LEVEL           error, warning (the default), info or debug\n"
    "  --help                      show this help\n";

bool fail(const std::string& problem, int& exit_code) {
  std::cerr << "error: " << problem << "; --help lists the options" << std::endl;
  exit_code = 2;
  return false;
}

bool read_parameter(const std::string& text, Parameter& parameter) {
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals) return false;
  parameter = {text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)};
  return !parameter.instance.empty() && !parameter.property.empty();
}

bool read_level(const std::string& text, RTT::LogLevel& level) {
  const std::pair<const char*, RTT::LogLevel> levels[] = {
      {"error", RTT::Error}, {"warning", RTT::Warning}, {"info", RTT::Info}, {"debug", RTT::Debug}};
  for (const auto& it : levels) {
    if (text != it.first) continue;
    level = it.second;
    return true;
  }
  return false;
}

}  // namespace

bool read_time(const std::string& text, Nanoseconds& time) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double number = 0;
  std::string unit;
  if (!(in >> number)) return false;
  in >> unit >> std::ws;
  if (!in.eof()) return false;
  const std::pair<const char*, double> units[] = {{"ns", 1},    {"us", 1e3},   {"ms", 1e6},
                                                  {"s", 1e9},   {"min", 60e9}, {"h", 3600e9}};
  for (const auto& it : units) {
    if (unit != it.first) continue;
    // 30 years, which no clock of the computer overflows.
    if (!(number > 0) || number * it.second > 1e18) return false;
    time = static_cast<Nanoseconds>(number * it.second);
    return time > 0;
  }
  return false;
}

bool read_options(int argc, char** argv, const std::string& deployment, Options& options, int& exit_code) {
  for (int index = 1; index < argc; ++index) {
    std::string option = argv[index], value;
    bool has_value = false;
    const std::size_t equals = option.find('=');
    if (option.compare(0, 2, "--") == 0 && equals != std::string::npos) {
      value = option.substr(equals + 1);
      option.resize(equals);
      has_value = true;
    }
    const bool takes_value =
        option == "--for" || option == "--param" || option == "--trace" || option == "--log-level";
    if (takes_value && !has_value) {
      if (index + 1 == argc) return fail(option + " needs a value", exit_code);
      value = argv[++index];
    } else if (!takes_value && has_value) {
      return fail(option + " takes no value", exit_code);
    }
    if (option == "--help") {
      std::cout << "Runs deployment " << deployment << ".\n\n" << usage;
      exit_code = 0;
      return false;
    } else if (option == "--for") {
      if (!read_time(value, options.length)) {
        return fail("--for takes a time with its unit (ns, us, ms, s, min, h), such as 10s, and not `" + value + "`", exit_code);
      }
    } else if (option == "--param") {
      Parameter parameter;
      if (!read_parameter(value, parameter)) {
        return fail("--param takes INSTANCE.NAME=VALUE, and not `" + value + "`", exit_code);
      }
      options.parameters.push_back(parameter);
    } else if (option == "--simulate-time") {
      options.simulates_time = true;
    } else if (option == "--spend-times") {
      options.spends_times = true;
    } else if (option == "--allow-non-realtime") {
      options.allows_non_realtime = true;
    } else if (option == "--inputs") {
      options.records_inputs = true;
    } else if (option == "--live") {
      options.is_live = true;
    } else if (option == "--trace") {
      if (value.empty()) return fail("--trace takes the path of a folder", exit_code);
      options.trace_folder = value;
    } else if (option == "--log-level") {
      if (!read_level(value, options.log_level)) {
        return fail("--log-level takes error, warning, info or debug, and not `" + value + "`", exit_code);
      }
    } else {
      return fail("unknown option `" + option + "`", exit_code);
    }
  }
  return true;
}

}  // namespace mauve
