// Sources that write faster than their readers are released; readers that data release, in a chain; and components that share a thread.
// The gap between releases is kept, no value is lost, and a shared thread keeps its order. Two readers join the values of two sources:
// any releases one, and all are needed by the other. A thread with a queue executes periods of two clocks and of two readers in the order
// of their releases. Argument: the periods of each source.

#include <sched.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <map>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <rtt/Activity.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/TaskContext.hpp>

#include "context.hpp"

namespace {

constexpr mauve::Nanoseconds period = 20000, gap = 50000;

// So many values go through a chain one by one: a source that catches up could write all of its values before a reader has
// read one, where only the last is kept.
constexpr std::uint64_t one_by_one = 10;

std::atomic<int> faults{0};

void check(bool holds, const char* text) {
  if (holds || faults.fetch_add(1) > 10) return;
  std::cerr << "does not hold: " << text << std::endl;
}

#define CHECK(condition) check((condition), #condition)

// Of the interposer, where it is loaded: see interposer.cpp.
extern "C" __attribute__((weak)) void interposer_counts(bool counts);

class Node : public RTT::TaskContext {
 public:
  Node(const std::string& name, std::uint64_t most) : RTT::TaskContext(name), out("out"), in("in"), other("other"), most_(most) {
    addOperation("add", &Node::add, this, RTT::OwnThread);
  }

  int add(int number) { return number + 1; }

  void updateHook() override {
    if (turn != nullptr) {
      CHECK(*turn == place);
      *turn = (place + 1) % 3;
    }
    std::uint64_t number = 0, second = 0;
    if (joins) {
      const bool has_first = in.read(number, false) == RTT::NewData, has_second = other.read(second, false) == RTT::NewData;
      if (has_first && has_second) ++pairs;
      if (has_first || has_second) ++periods;
      return;
    }
    if (is_source) {
      number = periods + 1;
      if (number > most_ || (number <= one_by_one && end->last + 1 < number)) return;
    } else if (in.connected()) {
      // One value in each period: what is left in a buffer releases it again.
      if (in.read(number, false) != RTT::NewData) return;
      CHECK(number > last);
      last.store(number);
    }
    // A reader counts before others have the value, which `main` waits for; a source when its write is over: its readers may go then.
    if (!is_source) ++periods;
    if (number > 0) out.write(number);
    if (is_source) ++periods;
  }

  RTT::OutputPort<std::uint64_t> out;
  RTT::InputPort<std::uint64_t> in, other;
  std::atomic<std::uint64_t> periods{0}, last{0};
  // Whether it reads both inputs, and in how many periods both had a value.
  bool joins = false;
  std::atomic<std::uint64_t> pairs{0};
  bool is_source = false;
  // The last reader of the chain of a source.
  const Node* end = nullptr;
  // The turns of a shared thread.
  std::size_t* turn = nullptr;
  std::size_t place = 0;
  mauve::PeriodicThread* thread = nullptr;

 private:
  const std::uint64_t most_;
};

// One of a queue: a reader, whose `other` gets each value before it or after it in turn; or executed by a clock.
class Queued : public RTT::TaskContext {
 public:
  explicit Queued(const std::string& name) : RTT::TaskContext(name), in("in") {}

  void updateHook() override {
    sched_param has = {};
    if (sched_getscheduler(0) == SCHED_FIFO && sched_getparam(0, &has) == 0) CHECK(has.sched_priority == (is_not_preempted ? 99 : 1));
    std::uint64_t number = 0;
    if (other == nullptr || in.read(number, false) != RTT::NewData) return;
    CHECK(number == last + 1 && other->last + (number % 2 == place ? 1 : 0) == number);
    last = number;
  }

  RTT::InputPort<std::uint64_t> in;
  std::atomic<std::uint64_t> last{0};
  const Queued* other = nullptr;
  std::size_t place = 0;
  bool is_not_preempted = false;
};

// Writes to both readers of a queue, one after the other, when both have had the value before.
class Turns : public RTT::TaskContext {
 public:
  Turns() : RTT::TaskContext("turns"), outs{{"even"}, {"odd"}} {}

  void updateHook() override {
    for (const auto& reader : readers) {
      if (reader->last < number) return;
    }
    ++number;
    outs[number % 2].write(number);
    outs[1 - number % 2].write(number);
  }

  RTT::OutputPort<std::uint64_t> outs[2];
  std::array<const Queued*, 2> readers{};
  std::uint64_t number = 0;
};

// The last releases of a reader.
struct Releases {
  std::size_t burst = 1;
  std::deque<mauve::Nanoseconds> last;
  std::uint64_t count = 0;

  void add(mauve::Nanoseconds release) {
    last.push_back(release);
    if (last.size() <= burst) return;
    CHECK(last.back() - last.front() >= gap);
    last.pop_front();
    ++count;
  }
};

// The numbers of the readers that data release.
struct Chain {
  std::unique_ptr<Node> source, first, second;
  Releases of_first, of_second;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::uint64_t most = std::strtoull(argv[1], nullptr, 10);
  mauve::TraceQueue queue;
  bool is_fine = true;
  std::vector<Chain> chains(4);
  const auto activity_of = [&](Node& node, Node* leader, mauve::Nanoseconds length) {
    auto* const activity = new RTT::Activity(ORO_SCHED_OTHER, 0, 1e-9 * static_cast<double>(length), 0u, nullptr, node.getName());
    node.thread = &activity->thread();
    if (length == gap) node.thread->context().trace = &queue;
    if (leader != nullptr) node.thread->run_in(*leader->thread);
    return activity;
  };
  const auto start = [&](RTT::TaskContext& node, RTT::Activity* activity) {
    is_fine = node.setActivity(activity) && is_fine;
  };
  for (std::size_t index = 0; index < chains.size(); ++index) {
    Chain& chain = chains[index];
    const std::string name = std::to_string(index);
    chain.source.reset(new Node("source" + name, most));
    chain.first.reset(new Node("first" + name, most));
    chain.second.reset(new Node("second" + name, most));
    chain.source->is_source = true;
    chain.source->end = chain.second.get();
    // A buffer that never overflows, or the last value only.
    const bool is_buffer = index % 2 == 0;
    const auto policy = is_buffer ? RTT::ConnPolicy::circularBuffer(static_cast<int>(most)) : RTT::ConnPolicy::data();
    is_fine = chain.source->out.connectTo(&chain.first->in, policy) && is_fine;
    is_fine = chain.first->out.connectTo(&chain.second->in, RTT::ConnPolicy::data()) && is_fine;
    chain.of_first.burst = index < 2 ? 1 : 3;
    start(*chain.source, activity_of(*chain.source, nullptr, period));
    for (Node* node : {chain.first.get(), chain.second.get()}) {
      RTT::Activity* const activity = activity_of(*node, nullptr, gap);
      is_fine = node->thread->release_by(node->in, node == chain.first.get() ? chain.of_first.burst : 1, false) && is_fine;
      start(*node, activity);
    }
    CHECK(!chain.first->thread->release_by(chain.first->out, 1, false));
  }
  std::vector<std::unique_ptr<Node>> joiners;
  for (const bool needs_all : {false, true}) {
    joiners.emplace_back(new Node(needs_all ? "all" : "any", most));
    Node& joiner = *joiners.back();
    joiner.joins = true;
    is_fine = chains[0].source->out.connectTo(&joiner.in, RTT::ConnPolicy::data()) && is_fine;
    is_fine = chains[1].source->out.connectTo(&joiner.other, RTT::ConnPolicy::data()) && is_fine;
    RTT::Activity* const activity = activity_of(joiner, nullptr, gap);
    is_fine = joiner.thread->release_by(joiner.in, 1, needs_all) && is_fine;
    is_fine = joiner.thread->release_by(joiner.other, 1, needs_all) && is_fine;
    start(joiner, activity);
    is_fine = joiner.start() && is_fine;
  }
  std::size_t turn = 0;
  std::vector<std::unique_ptr<Node>> group;
  for (std::size_t place = 0; place < 3; ++place) {
    group.emplace_back(new Node("shared" + std::to_string(place), most));
    group[place]->turn = &turn;
    group[place]->place = place;
    RTT::Activity* const activity = activity_of(*group[place], place == 0 ? nullptr : group[0].get(), period);
    if (place == 0) group[0]->thread->hold();
    start(*group[place], activity);
  }
  // Readers of the numbers 0 and 1, and clocks.
  const mauve::Nanoseconds clocks[] = {1, 1, 200000, 700000};
  Turns turns;
  std::vector<std::unique_ptr<Queued>> queued;
  std::vector<mauve::PeriodicThread*> queued_threads;
  for (std::size_t place = 0; place < 4; ++place) {
    queued.emplace_back(new Queued("queued" + std::to_string(place)));
    Queued& node = *queued.back();
    node.place = place;
    node.is_not_preempted = place % 2 == 1;
    auto* const activity = new RTT::Activity(ORO_SCHED_RT, 1, 1e-9 * static_cast<double>(clocks[place]), 0u, nullptr, node.getName());
    mauve::PeriodicThread& thread = activity->thread();
    queued_threads.push_back(&thread);
    thread.context().trace = &queue;
    thread.hold();
    if (node.is_not_preempted) thread.set_not_preempted();
    if (place < 2) is_fine = turns.outs[place].connectTo(&node.in, RTT::ConnPolicy::data()) && is_fine;
    if (place < 2) is_fine = thread.release_by(node.in, 1, false) && is_fine;
    if (place > 0) thread.queue_in(*queued_threads[0]);
    start(node, activity);
  }
  for (std::size_t place = 0; place < 2; ++place) queued[place]->other = turns.readers[1 - place] = queued[1 - place].get();
  start(turns, new RTT::Activity(ORO_SCHED_OTHER, 0, 1e-9 * static_cast<double>(period), 0u, nullptr, "turns"));
  for (const auto& node : queued) is_fine = node->start() && is_fine;
  // All know it by then. What came before it would be released at it.
  const mauve::Nanoseconds first = mauve::now() + 20000000;
  for (mauve::PeriodicThread* thread : queued_threads) thread->release_at(first);
  while (mauve::now() < first) mauve::pause();
  is_fine = turns.start() && is_fine;
  for (std::size_t place = 3; place-- > 0;) is_fine = group[place]->start() && is_fine;
  group[0]->thread->release_at(mauve::now());
  for (Chain& chain : chains) {
    for (Node* node : {chain.first.get(), chain.second.get(), chain.source.get()}) is_fine = node->start() && is_fine;
  }

  // Calls are executed in between, also before any value comes and by a shared thread.
  RTT::TaskContext caller("caller");
  std::vector<Node*> called{group[1].get(), group[2].get()};
  for (Chain& chain : chains) called.push_back(chain.second.get());
  mauve::Nanoseconds last_queued = 0;
  std::map<std::string, mauve::Nanoseconds> last_of;
  const auto drain = [&] {
    for (const mauve::TraceRecord& record : queue.take()) {
      if (record.kind != mauve::TraceRecord::Period) continue;
      const std::string name = record.instance;
      const std::size_t index = static_cast<std::size_t>(name.back() - '0');
      if (name.compare(0, 6, "queued") == 0) {
        CHECK(record.release >= last_queued);
        mauve::Nanoseconds& before = last_of[name];
        if (index >= 2 && before > 0) CHECK(record.release == before + clocks[index]);
        last_queued = before = record.release;
      }
      if (name.compare(0, 5, "first") == 0) chains[index].of_first.add(record.release);
      if (name.compare(0, 6, "second") == 0) chains[index].of_second.add(record.release);
    }
  };
  if (interposer_counts != nullptr) interposer_counts(true);
  const auto is_done = [&](const Chain& chain) {
    return chain.source->periods >= most && chain.first->last == most && chain.second->last == most;
  };
  int moments = 0;
  const auto wait_until = [&](auto holds, const char* text) {
    for (; is_fine && faults == 0 && !holds(); ++moments) {
      drain();
      mauve::pause();
      if (moments > 600000) check(false, text);
    }
  };
  for (const Chain& chain : chains) wait_until([&] { return is_done(chain); }, "all values arrive");
  for (const auto& joiner : joiners) wait_until([&] { return joiner->periods > 0; }, "values release a reader of two ports");
  if (interposer_counts != nullptr) interposer_counts(false);
  for (Node* node : called) {
    RTT::OperationCaller<int(int)> add("add");
    caller.requires()->addOperationCaller(add);
    is_fine = caller.requires()->connectTo(node->provides()) && is_fine;
    CHECK(add.call(1) == 2);
  }
  drain();
  std::uint64_t jobs = 0;
  for (const auto& joiner : joiners) {
    // One source may have written all before the other one begins. Its last value is enough for the reader that needs both; the one
    // that any releases has read it by then.
    CHECK(joiner == joiners.front() || joiner->pairs > 0);
    jobs += joiner->thread->statistics().periods;
    is_fine = joiner->stop() && is_fine;
    joiner->setActivity(nullptr);
  }
  for (Chain& chain : chains) {
    CHECK(chain.of_first.count > 0 && chain.of_second.count > 0);
    // Every value of a buffer has had a period.
    if (&chain == &chains[0] || &chain == &chains[2]) CHECK(chain.first->periods == most);
    for (Node* node : {chain.source.get(), chain.first.get(), chain.second.get()}) {
      jobs += node->thread->statistics().periods;
      is_fine = node->stop() && is_fine;
    }
    for (Node* node : {chain.source.get(), chain.first.get(), chain.second.get()}) node->setActivity(nullptr);
  }
  is_fine = turns.stop() && is_fine;
  turns.setActivity(nullptr);
  CHECK(turns.number > 10);
  queued_threads[0]->stop();
  for (std::size_t place = 0; place < 4; ++place) {
    CHECK(place >= 2 || queued[place]->last + 1 >= turns.number);
    CHECK(queued_threads[place]->statistics().periods > 0);
    jobs += queued_threads[place]->statistics().periods;
    is_fine = queued[place]->stop() && is_fine;
  }
  for (const auto& node : queued) node->setActivity(nullptr);
  group[0]->thread->stop();
  for (const auto& node : group) jobs += node->thread->statistics().periods;
  const std::uint64_t shared = group[0]->thread->statistics().periods;
  for (const auto& node : group) CHECK(shared - node->thread->statistics().periods <= 1 && node->stop());
  for (const auto& node : group) node->setActivity(nullptr);
  std::cout << jobs << " periods, " << faults << " faults" << std::endl;
  return is_fine && faults == 0 && shared > 0 ? 0 : 1;
}
