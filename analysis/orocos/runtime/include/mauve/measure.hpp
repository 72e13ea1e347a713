// Runs codels alone, in one thread on one CPU, and records their executions as those of a robot.

#ifndef MAUVE_MEASURE_HPP
#define MAUVE_MEASURE_HPP

#include <cstddef>
#include <functional>
#include <string>

// The build file of standalone programs says it.
#ifndef MAUVE_BUILD
#define MAUVE_BUILD ""
#endif

namespace mauve {

class Measurement {
 public:
  class State;
  explicit Measurement(State& state) : state_(state) {}
  // Calls a codel many times, with its rows of inputs in turn: blocks of executions one after the other, and of others for which the
  // caches are filled with other data before each.
  void run(const char* codel, std::size_t rows, const std::function<void(std::size_t)>& call);
  // By `call`, directly before the codel.
  void prepare();

 private:
  State& state_;
};

// The main of a program: its arguments are the folder of the recording and the number of executions of each codel.
int measure(int argc, char** argv, void (*codels)(Measurement&), const std::string& build = MAUVE_BUILD);

}  // namespace mauve

#endif
