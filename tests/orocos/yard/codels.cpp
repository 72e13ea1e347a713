// Its codels: what they say goes to the standard output, a whole line at a time.

#include <yard/yard-codels.hpp>

#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>

namespace {

bool line(const std::string& text) {
  const std::string whole = "@ " + text + "\n";
  return ::write(1, whole.data(), whole.size()) == static_cast<ssize_t>(whole.size());
}

}  // namespace

namespace yard {

bool say(const std::string& who, const std::string& what, int n) {
  const char* const refuses = std::getenv("YARD_REFUSES");
  const bool is_said = line(who + " " + what + " " + std::to_string(n));
  return is_said && (refuses == nullptr || refuses != what);
}

void grow(int& n) { ++n; }

int trip(const std::string& where, int n) {
  const char* const throws = std::getenv("YARD_THROWS");
  if (n == 3 && throws != nullptr && throws == where) throw std::runtime_error("on purpose");
  return n;
}

int judge(RTT::FlowStatus read, RTT::SendStatus call) { return 10 * read + call; }

bool scalars(char a, short b, long c, std::int8_t d, std::int64_t e, std::uint8_t f, std::uint16_t g,
             std::uint32_t h, std::uint64_t i, std::size_t j, float k, double l, bool m,
             const std::string& n) {
  std::ostringstream out;
  out << "scalars " << static_cast<int>(a) << ' ' << b << ' ' << c << ' ' << static_cast<int>(d) << ' ' << e << ' '
      << static_cast<int>(f) << ' ' << g << ' ' << h << ' ' << i << ' ' << j << ' ' << k << ' ' << l << ' ' << m
      << ' ' << n;
  return line(out.str());
}

}  // namespace yard
