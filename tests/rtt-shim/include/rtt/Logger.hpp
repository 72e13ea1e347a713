#ifndef RTT_SHIM_LOGGER_HPP
#define RTT_SHIM_LOGGER_HPP

#include <iostream>
#include <mutex>
#include <sstream>

namespace RTT {

enum LogLevel { Never = 0, Fatal, Critical, Error, Warning, Info, Debug, RealTime };

namespace internal {

// Ends a line of the log: see `endlog`.
struct EndOfLog {};

// One line of the log, which a thread writes to the standard error when it is whole.
class LogLine {
 public:
  explicit LogLine(LogLevel level) : level_(level) {}

  template <class T>
  LogLine& operator<<(const T& value) {
    text_ << value;
    return *this;
  }

  LogLine& operator<<(EndOfLog) {
    static std::mutex mutex;
    static const char* const names[] = {"Never", "Fatal", "Critical", "Error",
                                        "Warning", "Info", "Debug", "RealTime"};
    const std::lock_guard<std::mutex> lock(mutex);
    std::cerr << "[" << names[level_] << "] " << text_.str() << std::endl;
    text_.str("");
    return *this;
  }

 private:
  LogLevel level_;
  std::ostringstream text_;
};

}  // namespace internal

inline internal::LogLine log(LogLevel level) { return internal::LogLine(level); }
inline internal::EndOfLog endlog() { return internal::EndOfLog(); }

}  // namespace RTT

#endif
