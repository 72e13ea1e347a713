#include "rtt/Logger.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "mauve/clock.hpp"
#include "queue.hpp"
#include "rtt/ExecutionEngine.hpp"

namespace mauve {
namespace {

using RTT::internal::LogLine;

struct Line {
  RTT::LogLevel level;
  std::size_t length;
  char text[LogLine::longest];
};

void write_all(const char* text, std::size_t length) {
  while (length > 0) {
    const ssize_t written = ::write(STDERR_FILENO, text, length);
    // What cannot be written is lost: there is nowhere to say so.
    if (written <= 0) return;
    text += written;
    length -= static_cast<std::size_t>(written);
  }
}

// Writes lines of the log in a thread of its own.
class Logger {
 public:
  Logger() : lines_(512), thread_([this] { run(); }) {}

  ~Logger() {
    ends_ = 1;
    wake();
    thread_.join();
  }

  void put(RTT::LogLevel level, const char* text, std::size_t length) {
    if (level > level_.load(std::memory_order_relaxed)) return;
    lines_.put([=](Line& line) {
      line.level = level;
      line.length = std::min(length, sizeof line.text);
      std::memcpy(line.text, text, line.length);
    });
    wake();
  }

  void set_level(RTT::LogLevel level) { level_ = level; }

  void flush() {
    const int asked = asked_.load();
    for (int tries = 0; tries < 10000 && written_.load() - asked < 0; ++tries) pause();
  }

 private:
  void wake() {
    asked_.fetch_add(1);
    RTT::internal::Waiting::notify(asked_);
  }

  void run() {
    // A thread of a real-time process has its scheduler.
    sched_param parameter = {};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameter);
    while (true) {
      const int asked = asked_.load();
      const bool is_last = ends_ != 0;
      while (lines_.take([](const Line& line) { write_line(line); })) {
      }
      say_what_is_lost();
      written_ = asked;
      if (is_last) return;
      RTT::internal::Waiting::wait(asked_, asked);
    }
  }

  static void write_line(const Line& line) {
    static const char* const names[] = {"Never", "Fatal", "Critical", "Error",
                                        "Warning", "Info", "Debug", "RealTime"};
    char out[sizeof line.text + 16];
    std::size_t length = 0;
    const auto append = [&](const char* text, std::size_t size) {
      std::memcpy(out + length, text, size);
      length += size;
    };
    append("[", 1);
    append(names[line.level], std::strlen(names[line.level]));
    append("] ", 2);
    append(line.text, line.length);
    append("\n", 1);
    write_all(out, length);
  }

  void say_what_is_lost() {
    const std::uint64_t lost = lines_.lost();
    if (lost == said_lost_) return;
    const std::string text = "[Warning] " + std::to_string(lost - said_lost_) + " lines of the log are lost: too many at once\n";
    write_all(text.data(), text.size());
    said_lost_ = lost;
  }

  Queue<Line> lines_;
  std::atomic<int> asked_{0}, written_{0}, ends_{0};
  std::atomic<int> level_{RTT::Warning};
  std::uint64_t said_lost_ = 0;
  std::thread thread_;
};

Logger& logger() {
  static Logger logger;
  return logger;
}

}  // namespace

void set_log_level(RTT::LogLevel level) { logger().set_level(level); }
void flush_log() { logger().flush(); }

}  // namespace mauve

namespace RTT {
namespace internal {

void LogLine::write(LogLevel level, const char* text, std::size_t length) { mauve::logger().put(level, text, length); }

}  // namespace internal
}  // namespace RTT
