// Records inputs of codels: see mauve/inputs.hpp.

#include "mauve/inputs.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <locale>
#include <sstream>

#include "context.hpp"

namespace mauve {
namespace {

// Of one codel.
constexpr std::size_t most_rows = 128, most_bytes = 1 << 20;

std::mutex all_mutex;
std::vector<Inputs*> all;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    char code[8];
    std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    out += c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ' || c == 0x7f ? code : std::string(1, c);
  }
  return out + "\"";
}

std::size_t size_of(const std::vector<std::string>& row) {
  std::size_t size = 0;
  for (const std::string& it : row) size += it.size();
  return size;
}

}  // namespace

Inputs::Inputs(const char* name, std::initializer_list<const char*> names) : codel(name), parameters(names.begin(), names.end()) {
  const std::lock_guard<std::mutex> held(all_mutex);
  all.push_back(this);
}

std::string Inputs::text() {
  const std::lock_guard<std::mutex> held(mutex);
  std::string out = "\n# " + std::to_string(rows.size()) + " of " + std::to_string(calls) + " calls; " + std::to_string(unwritten) +
                    " others have values that are too long, or that TOML has not.\n[" + quoted(codel) + "]\n";
  for (std::size_t index = 0; index < parameters.size(); ++index) {
    out += parameters[index] + " = [";
    for (const std::vector<std::string>& row : rows) out += row[index] + ", ";
    out += "]\n";
  }
  return out;
}

InputRow::InputRow(Inputs& inputs)
    : inputs_(inputs),
      lock_(inputs.mutex, std::try_to_lock),
      began_(cpu_time()),
      is_recorded_(lock_.owns_lock() && inputs.calls++ % inputs.stride == 0) {}

InputRow::~InputRow() {
  if (is_recorded_ && is_written_ && size_of(values_) <= most_bytes / most_rows) {
    inputs_.rows.push_back(std::move(values_));
  } else if (is_recorded_) {
    ++inputs_.unwritten;
  }
  if (is_recorded_ && inputs_.rows.size() > most_rows) {
    std::vector<std::vector<std::string>> kept;
    for (std::size_t at = 0; at < inputs_.rows.size(); at += 2) kept.push_back(std::move(inputs_.rows[at]));
    inputs_.rows = std::move(kept);
    inputs_.stride *= 2;
  }
  if (Context* const context = present_context()) context->copied += cpu_time() - began_;
}

void InputRow::number(double value) {
  std::ostringstream out;
  // A codel may have set another locale.
  out.imbue(std::locale::classic());
  out << std::setprecision(17) << value;
  const std::string text = std::isnan(value) ? "nan" : out.str();
  add(text.find_first_of(".en") == std::string::npos ? text + ".0" : text);
}

void InputRow::text(const std::string& value) {
  // Other letters would have to be valid UTF-8.
  for (const char c : value) is_written_ = is_written_ && static_cast<unsigned char>(c) < 0x80;
  add(quoted(value));
}

void InputRow::begin(char bracket) {
  add(std::string(1, bracket));
  is_first_ = true;
}

void InputRow::next(const char* name) {
  add((is_first_ ? "" : ", ") + std::string(name));
  is_first_ = false;
}

void InputRow::end(char bracket) {
  add(std::string(1, bracket));
  is_first_ = false;
}

std::string recorded_inputs() {
  const std::lock_guard<std::mutex> held(all_mutex);
  std::string out = "# Inputs of codels, which `mauve run --inputs` has recorded, for `mauve measure --inputs`.\n";
  for (Inputs* const it : all) out += it->text();
  return out;
}

void no_next_definition() {
  std::cerr << "error: a codel is not found in the library of its package; run without --inputs" << std::endl;
  std::_Exit(2);
}

}  // namespace mauve
