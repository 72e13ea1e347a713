// Records inputs of codels as values in TOML, which `mauve measure` reads.

#ifndef MAUVE_INPUTS_HPP
#define MAUVE_INPUTS_HPP

#include <dlfcn.h>

#include <cstdint>
#include <initializer_list>
#include <mutex>
#include <string>
#include <vector>

#include "mauve/clock.hpp"

namespace mauve {

// Inputs of one codel: those of some calls, spread over the run. Whenever there are too many, every second row is dropped. It lives as
// long as the program.
struct Inputs {
  Inputs(const char* codel, std::initializer_list<const char*> parameters);
  std::string text();

  const std::string codel;
  const std::vector<std::string> parameters;
  std::mutex mutex;
  std::vector<std::vector<std::string>> rows;
  // Of the calls, each `stride`-th is recorded; `unwritten` of them have values that TOML has not, or too long ones.
  std::uint64_t calls = 0, stride = 1, unwritten = 0;
};

// The inputs of one call.
class InputRow {
 public:
  // Never waits: where another thread records, this call is not recorded.
  explicit InputRow(Inputs& inputs);
  ~InputRow();
  explicit operator bool() const { return is_recorded_; }

  void parameter() { values_.emplace_back(); }
  void boolean(bool value) { add(value ? "true" : "false"); }
  template <class Integer>
  void integer(Integer value) {
    is_written_ = is_written_ && (value < Integer(1) || static_cast<std::uint64_t>(value) <= INT64_MAX);
    add(std::to_string(value));
  }
  void number(double value);
  void text(const std::string& value);
  // A list or the fields of a message: each value is preceded by `next`, with its name or nothing.
  void begin(char bracket);
  void next(const char* name);
  void end(char bracket);

 private:
  void add(const std::string& text) { values_.back() += text; }

  Inputs& inputs_;
  std::unique_lock<std::mutex> lock_;
  Nanoseconds began_;
  bool is_recorded_, is_written_ = true, is_first_ = true;
  std::vector<std::string> values_;
};

// What was recorded so far, as a file.
std::string recorded_inputs();

// Ends the program with a message.
[[noreturn]] void no_next_definition();

// The function of this name in a library of the program.
template <class Function>
Function* next_definition(Function* own) {
  Dl_info info = {};
  void* const address = reinterpret_cast<void*>(own);
  void* const next = dladdr(address, &info) != 0 && info.dli_sname != nullptr ? dlsym(RTLD_NEXT, info.dli_sname) : nullptr;
  if (next == nullptr || next == address) no_next_definition();
  return reinterpret_cast<Function*>(next);
}

}  // namespace mauve

#endif
