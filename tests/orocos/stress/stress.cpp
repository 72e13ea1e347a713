// A ring of components, each with a thread: every one sends samples to the next one, by connections of each kind, and calls an
// operation of another one. Nothing may be torn, lost against the policy of a connection, or out of order.
// Arguments: the number of components, the periods of each, and the priority of their threads.

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <rtt/Activity.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/TaskContext.hpp>

namespace {

std::atomic<int> faults{0};

void check(bool holds, const char* text) {
  if (holds || faults.fetch_add(1) > 10) return;
  std::cerr << "does not hold: " << text << std::endl;
}

#define CHECK(condition) check((condition), #condition)

// A sample whose parts must belong together.
struct Sample {
  std::uint64_t number = 0;
  std::string text = std::string(40, 'a');
  std::vector<std::uint64_t> copies = std::vector<std::uint64_t>(16);

  void set(std::uint64_t to) {
    number = to;
    for (char& c : text) c = static_cast<char>('a' + to % 26);
    for (std::uint64_t& copy : copies) copy = to;
  }

  bool is_whole() const {
    for (const char c : text) {
      if (c != static_cast<char>('a' + number % 26)) return false;
    }
    for (const std::uint64_t copy : copies) {
      if (copy != number) return false;
    }
    return text.size() == 40 && copies.size() == 16;
  }
};

// Of the interposer, where it is loaded: see interposer.cpp.
extern "C" __attribute__((weak)) void interposer_counts(bool counts);

void set_interposer(bool counts) {
  if (interposer_counts != nullptr) interposer_counts(counts);
}

class Node : public RTT::TaskContext {
 public:
  Node(const std::string& name, std::uint64_t most)
      : RTT::TaskContext(name), most_(most), last_out("last_out"), all_out("all_out"), recent_out("recent_out"), last_in("last_in"),
        all_in("all_in"), recent_in("recent_in"), add("add") {
    for (RTT::OutputPort<Sample>* port : {&last_out, &all_out, &recent_out}) port->setDataSample(Sample());
    addOperation("add", &Node::serve, this, RTT::OwnThread);
    requires()->addOperationCaller(add);
  }

  bool serve(std::uint64_t number, std::uint64_t& sum) {
    ++served_;
    sum = number + 1;
    return true;
  }

  void updateHook() override {
    const std::uint64_t period = periods + 1;
    if (period <= most_) write(period);
    read();
    collect();
    if (period <= most_) {
      ask(period);
      periods.store(period, std::memory_order_release);
    } else if (all_read_ > 0 && last_read_ > 0 && recent_read_ > 0 && collected_ > 0 && served_ > 0) {
      has_seen_all.store(true, std::memory_order_release);
    }
  }

  std::uint64_t collected() const { return collected_; }

 private:
  void write(std::uint64_t period) {
    sample_.set(period);
    CHECK(last_out.write(sample_) == RTT::WriteSuccess);
    CHECK(recent_out.write(sample_) == RTT::WriteSuccess);
    CHECK(last_out.number() == period && recent_out.number() == period);
    // A full buffer refuses a sample: it is written again in the next period.
    sample_.set(all_written_ + 1);
    if (all_out.write(sample_) == RTT::WriteSuccess) ++all_written_;
    CHECK(all_out.number() == period);
  }

  void read() {
    // What was written before is there, also while the next sample is being written.
    const std::uint64_t written = source->periods.load(std::memory_order_acquire);
    RTT::FlowStatus status = last_in.read(sample_);
    CHECK(status == RTT::NoData ? written == 0 : sample_.number >= written);
    if (status == RTT::NewData) {
      CHECK(sample_.is_whole() && sample_.number > last_read_ && last_in.number() == sample_.number);
      last_read_ = sample_.number;
    } else if (status == RTT::OldData) {
      CHECK(sample_.is_whole() && sample_.number == last_read_ && last_in.number() == last_read_);
    }
    while (all_in.read(sample_, false) == RTT::NewData) {
      CHECK(sample_.is_whole() && sample_.number == all_read_ + 1);
      // Writes that a full buffer refused have numbers, too.
      CHECK(all_in.number() >= sample_.number && all_in.number() > all_number_);
      all_read_ = sample_.number;
      all_number_ = all_in.number();
    }
    for (int tries = 0; tries < 4 && recent_in.read(sample_, false) == RTT::NewData; ++tries) {
      CHECK(sample_.is_whole() && sample_.number > recent_read_ && recent_in.number() == sample_.number);
      recent_read_ = sample_.number;
    }
  }

  void collect() {
    if (!is_sent_) return;
    bool result = false;
    std::uint64_t sum = 0;
    const RTT::SendStatus status = handle_.collectIfDone(result, sum);
    if (status == RTT::SendNotReady) return;
    CHECK(status == RTT::SendSuccess && result && sum == asked_ + 1);
    ++collected_;
    is_sent_ = false;
  }

  void ask(std::uint64_t period) {
    if (is_sent_) return;
    asked_ = period;
    handle_ = add.send(period, sum_);
    is_sent_ = true;
  }

  const std::uint64_t most_;
  Sample sample_;
  std::uint64_t all_written_ = 0, all_number_ = 0, last_read_ = 0, all_read_ = 0, recent_read_ = 0, collected_ = 0, served_ = 0, asked_ = 0, sum_ = 0;
  bool is_sent_ = false;
  RTT::SendHandle<bool(std::uint64_t, std::uint64_t&)> handle_;

 public:
  std::atomic<std::uint64_t> periods{0};
  // A thread may be done before those that it depends on have begun: it then goes on to read.
  std::atomic<bool> has_seen_all{false};
  // The component whose samples it reads.
  const Node* source = nullptr;
  RTT::OutputPort<Sample> last_out, all_out, recent_out;
  RTT::InputPort<Sample> last_in, all_in, recent_in;
  RTT::OperationCaller<bool(std::uint64_t, std::uint64_t&)> add;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const std::size_t count = std::strtoul(argv[1], nullptr, 10);
  const std::uint64_t most = std::strtoull(argv[2], nullptr, 10);
  const int priority = std::atoi(argv[3]);
  std::vector<std::unique_ptr<Node>> nodes;
  for (std::size_t index = 0; index < count; ++index) {
    nodes.emplace_back(new Node("node" + std::to_string(index), most));
  }
  bool is_fine = true;
  for (std::size_t index = 0; index < count; ++index) {
    Node& node = *nodes[index];
    Node& next = *nodes[(index + 1) % count];
    next.source = &node;
    is_fine = is_fine && node.last_out.connectTo(&next.last_in, RTT::ConnPolicy::data());
    is_fine = is_fine && node.all_out.connectTo(&next.all_in, RTT::ConnPolicy::buffer(5));
    is_fine = is_fine && node.recent_out.connectTo(&next.recent_in, RTT::ConnPolicy::circularBuffer(3));
    is_fine = is_fine && node.requires()->connectTo(nodes[(index + 7) % count]->provides());
  }
  for (const auto& node : nodes) {
    // Shorter than a period takes: each is late, and the next one follows at once.
    auto* const activity = new RTT::Activity(priority > 0 ? ORO_SCHED_RT : ORO_SCHED_OTHER, priority, 2e-5, 0u, nullptr,
                                             node->getName());
    is_fine = is_fine && node->setActivity(activity);
  }
  for (const auto& node : nodes) is_fine = is_fine && node->start();
  // What happens once is allowed to allocate.
  const auto wait_until = [&](std::uint64_t periods) {
    for (const auto& node : nodes) {
      while (is_fine && faults == 0 && node->periods < periods) mauve::pause();
    }
  };
  wait_until(most / 100);
  set_interposer(true);
  wait_until(most);
  set_interposer(false);
  for (const auto& node : nodes) {
    while (is_fine && faults == 0 && !node->has_seen_all) mauve::pause();
  }
  std::uint64_t calls = 0;
  for (const auto& node : nodes) {
    is_fine = node->stop() && is_fine;
    // Its thread still executes calls.
    node->setActivity(nullptr);
  }
  for (const auto& node : nodes) calls += node->collected();
  std::cout << count * most << " periods, " << calls << " calls, " << faults << " faults" << std::endl;
  return is_fine && faults == 0 ? 0 : 1;
}
