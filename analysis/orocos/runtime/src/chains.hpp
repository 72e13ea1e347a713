// Follows data along a chain of instances, by what their threads record.

#ifndef MAUVE_CHAINS_HPP
#define MAUVE_CHAINS_HPP

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "trace_file.hpp"

namespace mauve {

// The greatest time from a change in the world to the end of the first effect that shows it. Each write and each effect counts as if
// it carried the newest datum that its instance has read: the true latency may be greater, and is never less.
//
// From an instant on, a change is seen by the executions of the source that begin later. So when an effect shows a newer sample than
// all effects before it, a change just after the begin of the sample that they showed has waited until now. This counts only if
// all that the chain assumes held in the meantime, and all its activities had begun.
class ObservedChain {
 public:
  // `bound` may be `no_bound`, and `limit` 0: none.
  ObservedChain(const std::string& its_name, Nanoseconds its_bound, Nanoseconds its_limit)
      : name(its_name), bound(its_bound), limit(its_limit) {}

  // The ends are `codel NAME` or `port COMPONENT.PORT`.
  void add_step(const std::string& instance, const std::string& from, const std::string& to);
  // The instance stays in the states that are assumed of it.
  void assume_state(const std::string& instance, const std::string& state);
  // The codel returns true; the port has new data at each read.
  void assume_answer(const std::string& instance, const std::string& end);
  // Takes the next records. `lost` is the number of those that are missing so far.
  void follow(const std::vector<TraceRecord>& records, std::uint64_t lost);

  const std::string name;
  const Nanoseconds bound, limit;
  // The greatest latency, and the end of its effect; -1 without one.
  Nanoseconds greatest() const { return greatest_; }
  Nanoseconds at() const { return at_; }

 private:
  // Codels and ports, which may have the same name.
  struct End {
    explicit End(const std::string& text);
    bool is(const TraceRecord& record) const;
    TraceRecord::Kind kind;
    std::string name;
  };
  // An execution of the source: its number, 0 for none, and its begin.
  struct Sample {
    std::uint64_t number = 0;
    Nanoseconds at = 0;
  };
  struct Written {
    std::uint64_t number = 0;
    Sample carried;
  };
  struct Step {
    std::string instance;
    End from, to;
    std::vector<std::string> states;
    std::vector<End> answers;
    Sample carried;
    // The latest writes, by their numbers. What is not there any more counts as the newest sample.
    std::array<Written, 1024> written;
    bool has_begun;
    // So many periods must end before what is assumed holds again: variables may keep what was not as assumed for one more.
    int doubts;
  };

  Step* step_of(const std::string& instance);
  void follow(const TraceRecord& record);
  void period(Step& step, const TraceRecord& record);
  void effect(const Sample& shown, Nanoseconds at);

  std::vector<Step> steps_;
  Sample newest_, shown_;
  Nanoseconds valid_from_ = 0, greatest_ = -1, at_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace mauve

#endif
