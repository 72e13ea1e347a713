#include "recorder.hpp"

#include <cstdio>
#include <cstring>

namespace rig {

std::uint64_t Random::below(std::uint64_t bound) {
  state_ += 0x9e3779b97f4a7c15u;
  std::uint64_t mixed = state_;
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return (mixed ^ (mixed >> 31)) % bound;
}

namespace {
thread_local std::string* kept = nullptr;
}

void keep_lines(std::string& lines) { kept = &lines; }

// Nothing is lost where a component crashes, unless its lines are kept.
void line(const std::string& text) {
  if (kept != nullptr) {
    *kept += text + "\n";
    return;
  }
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

Random& results() {
  static thread_local Random random(0);
  return random;
}

std::string show(bool value) { return value ? "true" : "false"; }
std::string show(int value) { return std::to_string(value); }
std::string show(std::uint8_t value) { return std::to_string(value); }

// Their bits: nothing is rounded.
std::string show(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  char text[16];
  std::snprintf(text, sizeof text, "f%08x", static_cast<unsigned>(bits));
  return text;
}

std::string show(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  char text[32];
  std::snprintf(text, sizeof text, "d%016llx", static_cast<unsigned long long>(bits));
  return text;
}

std::string show(const std::string& value) {
  std::string out = "\"";
  for (const char c : value) {
    if (c >= ' ' && c <= '~' && c != '"' && c != '\\') {
      out += c;
    } else {
      char text[8];
      std::snprintf(text, sizeof text, "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
      out += text;
    }
  }
  return out + "\"";
}

std::string join(const std::vector<std::string>& values) {
  std::string out;
  for (const std::string& value : values) {
    if (!out.empty()) out += ", ";
    out += value;
  }
  return out;
}

void draw(Random& random, bool& value) { value = random.below(2) == 1; }
void draw(Random& random, int& value) { value = static_cast<int>(random.below(21)) - 10; }
void draw(Random& random, std::uint8_t& value) { value = static_cast<std::uint8_t>(random.below(6)); }
void draw(Random& random, float& value) { value = static_cast<float>(static_cast<int>(random.below(41)) - 20) / 4; }
void draw(Random& random, double& value) { value = static_cast<double>(static_cast<int>(random.below(41)) - 20) / 4; }

void draw(Random& random, std::string& value) {
  static const char* const texts[] = {"", "a", "left/\"wheel\"", "\\n", "?" "?/", "\xc3\xa9\n\t"};
  value = texts[random.below(6)];
}

Span::Span(const std::string& what, bool says_end) : what_(what), says_end_(says_end) { line("> " + what_); }

Span::~Span() {
  if (says_end_) line("< " + what_);
}

}  // namespace rig
