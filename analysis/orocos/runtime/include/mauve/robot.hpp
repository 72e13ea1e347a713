#ifndef MAUVE_ROBOT_HPP
#define MAUVE_ROBOT_HPP

#include <cstdint>
#include <memory>
#include <string>

#include "mauve/cpus.hpp"

// The build file of standalone programs says it.
#ifndef MAUVE_BUILD
#define MAUVE_BUILD ""
#endif

namespace mauve {

class Gateway;

// The response time of an activity whose response time is unbounded, or not analysed.
constexpr std::int64_t no_bound = -1;

// A deployment: what a generated program says of it, and then runs. All times are in nanoseconds; names are those of scripts.
class Robot {
 public:
  // `build`: the compiler of the program and its flags, for recordings.
  explicit Robot(const std::string& deployment, const std::string& build = MAUVE_BUILD);
  ~Robot();
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  // Creates an instance of a component, in lib<package>-components-<target>.so.
  void instance(const std::string& name, const std::string& package, const std::string& type);
  // Sets a property: a number, `true`, `false`, or a text as it is.
  void value(const std::string& instance, const std::string& property, const std::string& value);
  // Connects an output with an input, which keeps the last value.
  void connect(const std::string& output, const std::string& input);
  // The same; it keeps the last `buffer` values.
  void connect(const std::string& output, const std::string& input, int buffer);
  // Connects a required operation with a provided one.
  void operation(const std::string& required, const std::string& provided);
  // Creates the activity of an instance: its period; its priority, 0 in the background; its CPUs, none for any; the
  // offset of its first release; its deadline and response time.
  void activity(const std::string& instance, std::int64_t period, int priority, const Cpus& cpus, std::int64_t offset,
                std::int64_t deadline, std::int64_t response);

  // The periods of this instance are executed in the thread of another one, after those of all that are already.
  void run_in(const std::string& instance, const std::string& other);
  // The same, but this instance keeps its own releases, and the thread executes periods in the order of their releases.
  void queue_in(const std::string& instance, const std::string& other);
  // A period of this instance that has begun has the highest priority until its end.
  void not_preempted(const std::string& instance);
  // Data at an input releases the activity of this instance, at most `burst` times in a period. Of several inputs, data at one releases
  // it, or at all of them.
  void release_by(const std::string& instance, const std::string& input, std::uint64_t burst, bool needs_all);

  // Creates an activity that moves samples between ports of instances and the world outside. It outlives the robot's run.
  void gateway(Gateway& gateway, const std::string& name, std::int64_t period, int priority, const Cpus& cpus, std::int64_t deadline,
               std::int64_t response);

  // A chain, whose greatest latency is shown: its bound, and its limit, 0 without one.
  void chain(const std::string& name, std::int64_t bound, std::int64_t limit);
  // The next instance of that chain, and where data enters and leaves it: `codel NAME` or `port COMPONENT.PORT`.
  void step(const std::string& instance, const std::string& from, const std::string& to);
  // What that chain assumes: the instance stays in these states; this codel returns true, or this input has new data.
  void assume_state(const std::string& instance, const std::string& state);
  void assume_answer(const std::string& instance, const std::string& end);

  // For the virtual clock, and for codels that are stubs.
  void codel_time(const std::string& codel, std::int64_t time);
  // How long it waits at most.
  void codel_wait(const std::string& codel, std::int64_t time);
  // Of a read or a write of a port, named by its component and its own name.
  void access_time(const std::string& port, std::int64_t time);
  void program_time(const std::string& component, const std::string& state, const std::string& transition,
                    const std::string& program, std::int64_t time);
  void overhead(std::int64_t time);
  void other_work(const std::string& name, std::int64_t period, std::int64_t time, int priority, const Cpus& cpus);

  // Runs the deployment as the arguments say; `--help` lists them. Returns the exit code of the program: 0; 1 if a deadline was
  // missed, or an instance is in the exception state; 2 if it could not start.
  int run(int argc, char** argv);

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace mauve

#endif
