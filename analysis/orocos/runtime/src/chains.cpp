#include "chains.hpp"

#include <algorithm>

namespace mauve {

ObservedChain::End::End(const std::string& text)
    : kind(text.compare(0, 5, "port ") == 0 ? TraceRecord::Access : TraceRecord::Codel), name(text.substr(text.find(' ') + 1)) {}

bool ObservedChain::End::is(const TraceRecord& record) const { return kind == record.kind && name == record.name; }

void ObservedChain::add_step(const std::string& instance, const std::string& from, const std::string& to) {
  steps_.push_back({instance, End(from), End(to), {}, {}, {}, {}, false, 0});
}

ObservedChain::Step* ObservedChain::step_of(const std::string& instance) {
  const auto found = std::find_if(steps_.begin(), steps_.end(), [&](const Step& step) { return step.instance == instance; });
  return found == steps_.end() ? nullptr : &*found;
}

void ObservedChain::assume_state(const std::string& instance, const std::string& state) {
  if (Step* const step = step_of(instance)) step->states.push_back(state);
}

void ObservedChain::assume_answer(const std::string& instance, const std::string& end) {
  if (Step* const step = step_of(instance)) step->answers.push_back(End(end));
}

void ObservedChain::follow(const std::vector<TraceRecord>& records, std::uint64_t lost) {
  if (lost > lost_) {
    // Some of these, or others between them, are missing: all that was read may be the newest.
    lost_ = lost;
    valid_from_ = records.empty() ? now() : records.back().ended;
    newest_ = {newest_.number + 1, valid_from_};
    for (Step& step : steps_) step.carried = newest_;
    return;
  }
  for (const TraceRecord& record : records) follow(record);
}

void ObservedChain::follow(const TraceRecord& record) {
  Step* const step = step_of(record.instance);
  if (step == nullptr) return;
  if (record.kind == TraceRecord::Period) return period(*step, record);
  const bool is_state = record.kind == TraceRecord::Program && record.state[0] != '\0' && !step->states.empty();
  const bool is_no = record.outcome == Outcome::False || record.outcome == Outcome::NoData || record.outcome == Outcome::OldData;
  if ((is_state && std::find(step->states.begin(), step->states.end(), record.state) == step->states.end()) ||
      (is_no && std::any_of(step->answers.begin(), step->answers.end(), [&](const End& it) { return it.is(record); }))) {
    step->doubts = 2;
  }
  const bool is_first = step == &steps_.front();
  if (step->from.is(record)) {
    if (is_first) {
      newest_ = {newest_.number + 1, record.ended - record.elapsed};
      step->carried = newest_;
    } else if (record.outcome == Outcome::NewData) {
      const Written& written = (step - 1)->written[record.number % step->written.size()];
      const Sample& read = written.number == record.number ? written.carried : newest_;
      if (read.number > step->carried.number) step->carried = read;
    }
  }
  if (step->to.is(record) && step->carried.number > 0) {
    step->written[record.number % step->written.size()] = {record.number, step->carried};
    if (step == &steps_.back()) effect(step->carried, record.ended);
  }
}

void ObservedChain::period(Step& step, const TraceRecord& record) {
  if (!step.has_begun) valid_from_ = std::max(valid_from_, record.ended - record.elapsed);
  step.has_begun = true;
  if (step.doubts == 0) return;
  --step.doubts;
  valid_from_ = std::max(valid_from_, record.ended);
}

void ObservedChain::effect(const Sample& shown, Nanoseconds at) {
  if (shown.number <= shown_.number) return;
  const Nanoseconds from = std::max(shown_.at, valid_from_);
  shown_ = shown;
  const bool is_as_assumed =
      std::all_of(steps_.begin(), steps_.end(), [](const Step& step) { return step.has_begun && step.doubts == 0; });
  if (!is_as_assumed || from >= shown.at || at - from <= greatest_) return;
  greatest_ = at - from;
  at_ = at;
}

}  // namespace mauve
