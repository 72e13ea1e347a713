// What all generated components have in common, looked at from outside: a line for each check that does not hold.

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtt/Activity.hpp>
#include <rtt/ConnPolicy.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/Property.hpp>
#include <rtt/TaskContext.hpp>
#include <rtt/extras/SlaveActivity.hpp>

#include "../rig/library.hpp"
#include "../rig/main.hpp"

namespace {

int checks = 0, failures = 0;

void check(bool holds, const char* text, int line) {
  ++checks;
  if (holds) return;
  ++failures;
  std::cerr << "task.cpp:" << line << ": " << text << std::endl;
}

#define CHECK(condition) check((condition), #condition, __LINE__)

// A component whose periods are made here, and somebody who calls its operations.
struct Component {
  Component(const rig::ComponentLibrary& library, const std::string& type) : other("other") {
    for (const std::string& name : library.types()) {
      if (name.find("::" + type) != std::string::npos) task = library.create(name, type);
    }
    if (!task) throw std::runtime_error("no " + type);
    activity = new RTT::extras::SlaveActivity(0.1);
    task->setActivity(activity);
    other.setActivity(new RTT::extras::SlaveActivity(0.1));
  }

  template <class Signature>
  std::shared_ptr<RTT::OperationCaller<Signature>> caller(const std::string& name) {
    const auto caller = std::make_shared<RTT::OperationCaller<Signature>>(name);
    other.requires()->addOperationCaller(*caller);
    if (!other.requires()->connectTo(task->provides())) throw std::runtime_error("no operation " + name);
    return caller;
  }

  RTT::TaskContext other;
  std::unique_ptr<RTT::TaskContext> task;
  RTT::extras::SlaveActivity* activity;
};

enum Answer { Yes, No, Failed };

void what_its_thread_has(const rig::ComponentLibrary& library) {
  Component giver(library, "Giver");
  const auto runs_as = giver.caller<bool(int, unsigned int)>("mauve_runs_as");
  const auto ask = [&](int priority, unsigned int cpus) {
    bool result = false;
    const auto handle = runs_as->send(priority, cpus);
    giver.activity->execute();
    if (handle.collectIfDone(result) != RTT::SendSuccess) return Failed;
    return result ? Yes : No;
  };
  CHECK(giver.task->configure());
  // Nobody runs a test in real time, nor on the last of 32 CPUs alone.
  CHECK(ask(42, 0) == No && !giver.task->start());
  CHECK(ask(0, 0x80000000u) == No && !giver.task->start());
  setenv("MAUVE_ALLOW_NON_REALTIME", "false", 1);
  CHECK(ask(42, 0) == No && !giver.task->start());
  setenv("MAUVE_ALLOW_NON_REALTIME", "true", 1);
  CHECK(ask(42, 0) == Yes && giver.task->start());
  giver.activity->execute();
  CHECK(giver.task->isRunning() && giver.task->stop());
  // What was allowed at its start is looked at once more in its first period.
  CHECK(giver.task->start());
  unsetenv("MAUVE_ALLOW_NON_REALTIME");
  giver.activity->execute();
  CHECK(giver.task->inException() && giver.task->recover() && giver.task->configure());
  CHECK(ask(0, 0) == Yes && giver.task->start());
  giver.activity->execute();
  CHECK(giver.task->isRunning() && giver.task->stop());
}

void calls(const rig::ComponentLibrary& library) {
  Component giver(library, "Giver");
  const auto add = giver.caller<bool(int, int&)>("add");
  const auto call = [&](int& total) {
    const auto handle = add->send(1, total);
    giver.activity->execute();
    bool result = false;
    int there = 0;
    try {
      if (handle.collectIfDone(result, there) != RTT::SendSuccess) return No;
    } catch (const std::exception&) {
      return Failed;
    }
    return result && there == total ? Yes : No;
  };
  int total = 0;
  CHECK(call(total) == Failed && giver.task->getTaskState() == RTT::TaskContext::PreOperational);
  CHECK(giver.task->configure() && call(total) == Failed && giver.task->isConfigured());
  CHECK(giver.task->start() && call(total) == Yes && total == 1);
  CHECK(giver.task->stop() && call(total) == Failed && total == 1);
  CHECK(giver.task->start() && call(total) == Yes && total == 2);
  setenv("YARD_THROWS", "operation", 1);
  CHECK(call(total) == Failed && giver.task->inException());
  CHECK(call(total) == Failed && giver.task->inException());
  setenv("YARD_THROWS", "", 1);
  CHECK(giver.task->recover() && giver.task->configure() && giver.task->start() && call(total) == Yes);
  CHECK(giver.task->stop());
}

void values(const rig::ComponentLibrary& library) {
  Component scalars(library, "Scalars");
  const auto set = scalars.caller<bool(const std::string&, const std::string&)>("mauve_set");
  const auto sets = [&](const std::string& name, const std::string& text) { return set->call(name, text); };
  CHECK(sets("f", "200") && !sets("f", "256") && !sets("f", "-1") && !sets("f", "") && !sets("f", "1 "));
  CHECK(!sets("f", "x") && !sets("f", "1.5") && !sets("f", "0x1") && !sets("other", "1"));
  CHECK(sets("d", "-128") && !sets("d", "-129") && sets("d", "127") && !sets("d", "128"));
  CHECK(sets("i", "18446744073709551615") && !sets("i", "18446744073709551616"));
  CHECK(sets("e", "-9223372036854775808") && !sets("e", "9223372036854775808"));
  const auto f = dynamic_cast<RTT::Property<std::uint8_t>*>(scalars.task->getProperty("f"));
  CHECK(f != nullptr && f->get() == 200 && scalars.task->configure());
  // The interval ends below what the type has.
  CHECK(sets("f", "201") && !scalars.task->configure());
  // Names that it has itself, or scripts have, leave its own ports another.
  CHECK(scalars.task->getPort("period") != nullptr && scalars.task->getPort("mauve_period") != nullptr);
}

void what_it_shows(const rig::ComponentLibrary& library) {
  Component taker(library, "Taker");
  RTT::InputPort<std::string> state("state");
  RTT::InputPort<std::vector<double>> period("period");
  CHECK(state.connectTo(taker.task->getPort("state"), RTT::ConnPolicy::data()));
  CHECK(period.connectTo(taker.task->getPort("period"), RTT::ConnPolicy::data()));
  std::string name;
  std::vector<double> times;
  CHECK(taker.task->configure() && state.read(name) == RTT::NoData && period.read(times) == RTT::NoData);
  CHECK(taker.task->start() && state.read(name) == RTT::NewData && name == "Asking");
  taker.activity->execute();
  CHECK(state.read(name) == RTT::NewData && name == "Waiting");
  CHECK(period.read(times) == RTT::NewData && times.size() == 2 && times[0] > 0 && times[0] < 1 && times[1] == 0);
  taker.activity->execute();
  CHECK(state.read(name) == RTT::NewData && name == "Asking");
  CHECK(period.read(times) == RTT::NewData && taker.task->stop());
}

// What filled its inputs before it starts: a buffer would stay full for ever if it were read as often as it is written.
void what_it_clears(const rig::ComponentLibrary& library) {
  Component taker(library, "Taker");
  RTT::OutputPort<int> numbers("numbers");
  RTT::OutputPort<std::string> texts("texts");
  auto* const number_in = dynamic_cast<RTT::InputPort<int>*>(taker.task->getPort("class"));
  auto* const text_in = dynamic_cast<RTT::InputPort<std::string>*>(taker.task->getPort("text"));
  CHECK(numbers.connectTo(number_in, RTT::ConnPolicy::circularBuffer(3)));
  CHECK(texts.connectTo(text_in, RTT::ConnPolicy::data()));
  int number = 0;
  std::string text;
  const auto fill = [&](int last) {
    for (int it = 1; it <= last; ++it) numbers.write(it);
    texts.write("kept");
  };
  // Nobody said that there is a buffer.
  fill(5);
  CHECK(taker.task->configure() && taker.task->start());
  CHECK(number_in->read(number) == RTT::NewData && number == 3 && taker.task->stop());
  const auto has_buffer = taker.caller<bool(const std::string&)>("mauve_has_buffer");
  CHECK(has_buffer->call("class") && !has_buffer->call("other"));
  // Each time that it starts.
  for (int times = 0; times < 2; ++times) {
    fill(5);
    CHECK(taker.task->start() && number_in->read(number) == RTT::NoData);
    CHECK(text_in->read(text) == RTT::NewData && text == "kept");
    fill(1);
    CHECK(number_in->read(number) == RTT::NewData && number == 1 && taker.task->stop());
  }
}

}  // namespace

int ORO_main(int argc, char** argv) {
  if (argc != 2) return 2;
  const rig::ComponentLibrary library(argv[1]);
  what_its_thread_has(library);
  calls(library);
  values(library);
  what_it_shows(library);
  what_it_clears(library);
  std::cout << "= " << checks - failures << " of " << checks << " checks hold" << std::endl;
  return failures == 0 ? 0 : 1;
}
