// What generated components do in a run, line by line, and what codels of tests give: numbers that look random, which an
// interpreter of the model can predict.

#ifndef RIG_RECORDER_HPP
#define RIG_RECORDER_HPP

#include <cstdint>
#include <string>
#include <vector>

namespace rig {

// Numbers that look random, the same ones for one seed (splitmix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t below(std::uint64_t bound);

 private:
  std::uint64_t state_;
};

// Writes a line of the run.
void line(const std::string& text);

// From now on, this text keeps the lines of the calling thread.
void keep_lines(std::string& lines);

// What codels of the calling thread draw their results from.
Random& results();

std::string show(bool value);
std::string show(int value);
std::string show(std::uint8_t value);
std::string show(float value);
std::string show(double value);
std::string show(const std::string& value);
std::string join(const std::vector<std::string>& values);

void draw(Random& random, bool& value);
void draw(Random& random, int& value);
void draw(Random& random, std::uint8_t& value);
void draw(Random& random, float& value);
void draw(Random& random, double& value);
void draw(Random& random, std::string& value);

template <class T>
T drawn(Random& random) {
  T value;
  draw(random, value);
  return value;
}

// From its construction to the end of its block, or of its expression.
class Span {
 public:
  Span(const std::string& what, bool says_end);
  ~Span();
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;

 private:
  const std::string what_;
  const bool says_end_;
};

}  // namespace rig

#endif
