#ifndef MAUVE_RTT_LOGGER_HPP
#define MAUVE_RTT_LOGGER_HPP

#include <cstddef>
#include <ostream>
#include <streambuf>

namespace RTT {

enum LogLevel { Never = 0, Fatal, Critical, Error, Warning, Info, Debug, RealTime };

namespace internal {

// Ends a line of the log: see `endlog`.
struct EndOfLog {};

// One line of the log. When it ends, another thread writes it to the standard error: the thread that logs neither waits, locks
// nor allocates. The end of a line that is too long is lost, and a line if too many wait already, which the log then says.
class LogLine {
 public:
  static constexpr std::size_t longest = 480;

  LogLine(LogLevel level) : level_(level), stream_(&buffer_) {}
  LogLine(const LogLine&) = delete;
  LogLine& operator=(const LogLine&) = delete;

  template <class T>
  LogLine& operator<<(const T& value) {
    stream_ << value;
    return *this;
  }

  LogLine& operator<<(std::ios_base& (*manipulator)(std::ios_base&)) {
    stream_ << manipulator;
    return *this;
  }

  LogLine& operator<<(EndOfLog) {
    write(level_, buffer_.text(), buffer_.length());
    buffer_.clear();
    stream_.clear();
    return *this;
  }

 private:
  class Buffer : public std::streambuf {
   public:
    Buffer() { clear(); }
    void clear() { setp(text_, text_ + longest); }
    const char* text() const { return text_; }
    std::size_t length() const { return static_cast<std::size_t>(pptr() - text_); }

   private:
    char text_[longest];
  };

  static void write(LogLevel level, const char* text, std::size_t length);

  const LogLevel level_;
  Buffer buffer_;
  std::ostream stream_;
};

}  // namespace internal

// `log(Warning) << "text" << 1 << endlog();`
inline internal::LogLine log(LogLevel level) { return {level}; }
inline internal::EndOfLog endlog() { return internal::EndOfLog(); }

}  // namespace RTT

namespace mauve {

// Lines of higher levels are not written. At first: RTT::Warning.
void set_log_level(RTT::LogLevel level);

// Waits until all lines have been written, or a second has passed. Not in real-time threads.
void flush_log();

}  // namespace mauve

#endif
