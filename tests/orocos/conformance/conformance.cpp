// What Orocos RTT was seen to do, a check for each line of it. It builds against the runtime for Linux and against RTT.

#include <dlfcn.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <rtt/Activity.hpp>
#include <rtt/ConnPolicy.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/Operation.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/Property.hpp>
#include <rtt/TaskContext.hpp>
#include <rtt/extras/SlaveActivity.hpp>
#include <rtt/os/fosi.h>

#include "../rig/main.hpp"

namespace {

int failures = 0;
int checks = 0;

void check(bool holds, const char* text, int line) {
  ++checks;
  if (holds) return;
  ++failures;
  std::cerr << "conformance.cpp:" << line << ": " << text << std::endl;
}

#define CHECK(condition) check((condition), #condition, __LINE__)

using RTT::ConnPolicy;
using RTT::FlowStatus;
using RTT::NewData;
using RTT::NoData;
using RTT::OldData;

static_assert(!std::is_copy_constructible<RTT::InputPort<int>>::value, "ports are not copied");
static_assert(!std::is_copy_constructible<RTT::OutputPort<int>>::value, "ports are not copied");
static_assert(!std::is_copy_assignable<RTT::OutputPort<int>>::value, "ports are not copied");

// Can the hooks of a task be called from outside?
template <class T, class = void>
struct HasPublicHook : std::false_type {};
template <class T>
struct HasPublicHook<T, decltype(std::declval<T>().updateHook())> : std::true_type {};
static_assert(!HasPublicHook<RTT::TaskContext&>::value, "hooks are protected");

template <class F>
bool throws(F f) {
  try {
    f();
  } catch (...) {
    return true;
  }
  return false;
}

// One output port and one input port.
struct Ports {
  RTT::OutputPort<int> output;
  RTT::InputPort<int> input;

  Ports() : output("output"), input("input") {}

  // What a read gives, as `new 3`, `old 3` or `none 3`, where 3 is what the variable holds afterwards.
  std::string read(int before, bool copy_old_data = true) {
    int value = before;
    const FlowStatus status = input.read(value, copy_old_data);
    const std::string name = status == NewData ? "new " : status == OldData ? "old " : "none ";
    return name + std::to_string(value);
  }
};

void unconnected_ports() {
  Ports ports;
  CHECK(ports.read(7) == "none 7");
  CHECK(ports.output.write(1) == RTT::NotConnected);
  CHECK(!ports.output.connected() && !ports.input.connected());
  // The output has kept its value.
  CHECK(ports.output.connectTo(&ports.input, ConnPolicy::data()));
  CHECK(ports.output.connected() && ports.input.connected());
  CHECK(ports.read(7) == "new 1");

  Ports buffered;
  buffered.output.write(1);
  CHECK(buffered.output.connectTo(&buffered.input, ConnPolicy::buffer(2)));
  CHECK(buffered.read(7) == "none 7");

  Ports circular;
  circular.output.write(1);
  CHECK(circular.input.connectTo(&circular.output, ConnPolicy::circularBuffer(2)));
  CHECK(circular.read(7) == "none 7");

  RTT::InputPort<double> other("other");
  CHECK(!ports.output.connectTo(&other, ConnPolicy::data()));
}

void data_connection() {
  Ports ports;
  ports.output.connectTo(&ports.input, ConnPolicy::data());
  CHECK(ports.output.write(2) == RTT::WriteSuccess);
  CHECK(ports.output.write(3) == RTT::WriteSuccess);
  CHECK(ports.read(7) == "new 3");
  CHECK(ports.read(7) == "old 3");
  CHECK(ports.read(7, false) == "old 7");
  ports.input.clear();
  CHECK(ports.read(7) == "none 7");
  ports.output.write(4);
  CHECK(ports.read(7) == "new 4");
  ports.input.disconnect();
  CHECK(ports.read(7) == "none 7");
  CHECK(ports.output.write(5) == RTT::NotConnected);
}

void buffers() {
  Ports ports;
  ports.output.connectTo(&ports.input, ConnPolicy::buffer(2));
  CHECK(ports.output.write(1) == RTT::WriteSuccess);
  CHECK(ports.output.write(2) == RTT::WriteSuccess);
  CHECK(ports.output.write(3) == RTT::WriteFailure);
  CHECK(ports.read(7) == "new 1");
  CHECK(ports.read(7) == "new 2");
  CHECK(ports.read(7) == "old 2");

  Ports circular;
  circular.output.connectTo(&circular.input, ConnPolicy::circularBuffer(2));
  for (int value = 1; value <= 3; ++value) CHECK(circular.output.write(value) == RTT::WriteSuccess);
  CHECK(circular.read(7) == "new 2");
  CHECK(circular.read(7) == "new 3");
  CHECK(circular.read(7) == "old 3");

  Ports newest;
  newest.output.connectTo(&newest.input, ConnPolicy::buffer(4));
  newest.output.write(1);
  newest.output.write(2);
  int value = 7;
  CHECK(newest.input.readNewest(value) == NewData && value == 2);
}

// Two writers queue separately, and the reader sees both as new.
void two_writers() {
  Ports ports;
  RTT::OutputPort<int> second("second");
  ports.output.connectTo(&ports.input, ConnPolicy::data());
  second.connectTo(&ports.input, ConnPolicy::data());
  ports.output.write(1);
  second.write(2);
  const std::string first_read = ports.read(7), second_read = ports.read(7);
  CHECK((first_read == "new 1" && second_read == "new 2") || (first_read == "new 2" && second_read == "new 1"));
}

// A task that notes its hooks.
class Task : public RTT::TaskContext {
 public:
  explicit Task(const std::string& name, TaskState initial = PreOperational)
      : RTT::TaskContext(name, initial), number(1), asks("ask") {
    addOperation("twice", &Task::twice, this, RTT::OwnThread).doc("Twice a number.").arg("x", "The number.");
    addOperation("halve", &Task::halve, this, RTT::OwnThread);
    addOperation("note", &Task::note, this, RTT::OwnThread);
    addOperation("refuse", &Task::refuse, this, RTT::OwnThread);
    addProperty("number", number).doc("A number.");
  }

  bool configureHook() override {
    hooks += "configure ";
    return configures;
  }
  bool startHook() override {
    hooks += "start ";
    return starts;
  }
  void updateHook() override {
    hooks += "update ";
    if (calls_itself) hooks += std::to_string(twice_caller->call(21)) + " ";
    if (throws) throw std::runtime_error("on purpose");
    if (fails) error();
  }
  void stopHook() override { hooks += "stop "; }
  void cleanupHook() override { hooks += "cleanup "; }
  void exceptionHook() override { hooks += "exception "; }
  void errorHook() override { hooks += "error "; }

  int twice(int x) {
    hooks += "twice ";
    return 2 * x;
  }
  // The rest by reference.
  bool halve(int x, int& half, const std::string& text, int& rest) {
    half = x / 2;
    rest = x % 2;
    hooks += text + " ";
    return true;
  }
  void note(int& count) { ++count; }
  int refuse(int) { throw std::runtime_error("on purpose"); }
  void exception() override {
    hooks += "to_exception ";
    if (!stays) RTT::TaskContext::exception();
  }

  // The hooks since it was asked last.
  std::string take() {
    std::string taken;
    taken.swap(hooks);
    return taken.empty() ? taken : taken.substr(0, taken.size() - 1);
  }

  // With an activity that makes a period whenever it is asked to.
  RTT::extras::SlaveActivity* tick_by_hand() {
    RTT::extras::SlaveActivity* const activity = new RTT::extras::SlaveActivity(0.1);
    setActivity(activity);
    return activity;
  }

  bool configures = true, starts = true, throws = false, fails = false, calls_itself = false, stays = false;
  std::string hooks;
  int number;
  RTT::OperationCaller<int(int)> asks;
  std::unique_ptr<RTT::OperationCaller<int(int)>> twice_caller;
};

typedef RTT::TaskContext State;

void lifecycle() {
  Task task("task");
  RTT::extras::SlaveActivity* const activity = task.tick_by_hand();
  CHECK(task.getTaskState() == State::PreOperational);
  CHECK(!task.isConfigured() && !task.isRunning());
  CHECK(!task.start() && task.take() == "");
  CHECK(!task.stop() && !task.cleanup() && task.take() == "");

  task.configures = false;
  CHECK(!task.configure() && task.getTaskState() == State::PreOperational && task.take() == "configure");
  task.configures = true;
  CHECK(task.configure() && task.getTaskState() == State::Stopped && task.take() == "configure");
  CHECK(task.configure() && task.take() == "configure");
  activity->execute();
  CHECK(task.take() == "");

  task.starts = false;
  CHECK(!task.start() && task.getTaskState() == State::Stopped && task.take() == "start");
  task.starts = true;
  CHECK(task.start() && task.getTaskState() == State::Running && task.take() == "start");
  CHECK(task.isRunning() && task.isConfigured());
  CHECK(!task.start() && !task.configure() && !task.cleanup() && task.take() == "");
  activity->execute();
  activity->execute();
  CHECK(task.take() == "update update");

  CHECK(task.stop() && task.getTaskState() == State::Stopped && task.take() == "stop");
  activity->execute();
  CHECK(task.take() == "");
  CHECK(task.cleanup() && task.getTaskState() == State::PreOperational && task.take() == "cleanup");
  CHECK(!task.start());

  CHECK(Task("stopped", State::Stopped).getTaskState() == State::Stopped);
  CHECK(task.getName() == "task");
}

void exceptions() {
  Task task("task", State::Stopped);
  RTT::extras::SlaveActivity* const activity = task.tick_by_hand();
  task.start();
  task.take();
  task.throws = true;
  activity->execute();
  CHECK(task.inException() && task.getTaskState() == State::Exception);
  CHECK(task.take() == "update to_exception stop exception");
  activity->execute();
  CHECK(task.take() == "" && !task.start() && !task.configure());
  CHECK(task.recover() && task.getTaskState() == State::Stopped);
  CHECK(!task.recover());

  // One that begins unconfigured is cleaned up, and begins again.
  Task configured("configured");
  RTT::extras::SlaveActivity* const its_activity = configured.tick_by_hand();
  configured.configure();
  configured.start();
  configured.take();
  configured.throws = true;
  its_activity->execute();
  CHECK(configured.take() == "update to_exception stop cleanup exception");
  CHECK(configured.recover() && configured.getTaskState() == State::PreOperational);
}

void errors() {
  Task task("task", State::Stopped);
  RTT::extras::SlaveActivity* const activity = task.tick_by_hand();
  task.start();
  task.take();
  task.fails = true;
  activity->execute();
  CHECK(task.getTaskState() == State::RunTimeError && task.isRunning());
  CHECK(task.take() == "update error");
  activity->execute();
  CHECK(task.take() == "error");
  CHECK(task.recover() && task.getTaskState() == State::Running);
  task.stop();
}

template <class Signature>
struct Requirer : RTT::TaskContext {
  RTT::OperationCaller<Signature> caller;
  explicit Requirer(const std::string& operation) : RTT::TaskContext("requirer"), caller(operation) {
    this->requires()->addOperationCaller(caller);
    setActivity(new RTT::extras::SlaveActivity(0.1));
  }
};

void operations() {
  Task task("task", State::Stopped);
  RTT::extras::SlaveActivity* const activity = task.tick_by_hand();

  Requirer<int(int)> lonely("absent");
  CHECK(!lonely.caller.ready() && !lonely.requires()->ready());
  CHECK(!lonely.requires()->connectTo(task.provides()));
  int result = 7;
  CHECK(lonely.caller.send(1).collectIfDone(result) == RTT::SendFailure && result == 7);
  CHECK(RTT::SendHandle<int(int)>().collectIfDone(result) == RTT::SendFailure);

  Requirer<double(int)> wrong("twice");
  // An operation of another signature is connected all the same: who sends is told, and what RTT makes of
  // the call differs.
  CHECK(wrong.requires()->connectTo(task.provides()) && wrong.caller.ready());
  CHECK(throws([&] { wrong.caller.send(1); }));
  activity->execute();
  task.take();

  Requirer<int(int)> twice("twice");
  CHECK(twice.requires()->connectTo(task.provides()) && twice.caller.ready() && twice.requires()->ready());
  // The owner's engine runs where the owner is not started, too.
  const RTT::SendHandle<int(int)> handle = twice.caller.send(4);
  CHECK(task.take() == "");
  CHECK(handle.collectIfDone(result) == RTT::SendNotReady && result == 7);
  CHECK(handle.collectIfDone(result) == RTT::SendNotReady);
  activity->execute();
  CHECK(task.take() == "twice");
  CHECK(handle.collectIfDone(result) == RTT::SendSuccess && result == 8);
  result = 7;
  CHECK(handle.collectIfDone(result) == RTT::SendSuccess && result == 8);

  // The result, then what is not constant and by reference.
  Requirer<bool(int, int&, const std::string&, int&)> halve("halve");
  CHECK(halve.requires()->connectTo(task.provides()));
  const std::string text = "halve";
  int half = 7, rest = 7;
  const auto halved = halve.caller.send(9, half, text, rest);
  bool done = false;
  int half_there = 0, rest_there = 0;
  activity->execute();
  CHECK(halved.collectIfDone(done, half_there, rest_there) == RTT::SendSuccess);
  CHECK(done && half_there == 4 && rest_there == 1);
  CHECK(half == 4 && rest == 1);
  CHECK(task.take() == "halve");

  // Without a result, the first is an argument.
  Requirer<void(int&)> note("note");
  CHECK(note.requires()->connectTo(task.provides()));
  int count = 1, count_there = 0;
  const auto noted = note.caller.send(count);
  activity->execute();
  CHECK(noted.collectIfDone(count_there) == RTT::SendSuccess && count_there == 2);

  // What was sent is executed in its order, before the hook of the period.
  task.start();
  task.take();
  twice.caller.send(1);
  halve.caller.send(9, half, text, rest);
  activity->execute();
  CHECK(task.take() == "twice halve update");

  // A call from the owner's own thread does not wait for it.
  task.twice_caller.reset(new RTT::OperationCaller<int(int)>("twice"));
  task.requires()->addOperationCaller(*task.twice_caller);
  CHECK(task.requires()->connectTo(task.provides()));
  task.calls_itself = true;
  activity->execute();
  CHECK(task.take() == "update twice 42");
  CHECK(task.getOperation("twice") != nullptr && task.getOperation("absent") == nullptr);
  task.calls_itself = false;

  // An operation that throws brings its owner into Exception, unless that does not let it; its caller is thrown at.
  Requirer<int(int)> refused("refuse");
  CHECK(refused.requires()->connectTo(task.provides()));
  const auto refusal = refused.caller.send(1);
  task.stays = true;
  activity->execute();
  CHECK(task.take() == "to_exception update" && task.isRunning());
  result = 7;
  CHECK(throws([&] { refusal.collectIfDone(result); }) && result == 7);
  refused.caller.send(1);
  task.stays = false;
  activity->execute();
  CHECK(task.take() == "to_exception stop exception" && task.inException());
}

void properties() {
  Task task("task");
  CHECK(task.getProperty("absent") == nullptr);
  RTT::Property<int>* const number = dynamic_cast<RTT::Property<int>*>(task.getProperty("number"));
  CHECK(number != nullptr && number->ready() && number->get() == 1);
  number->set(5);
  CHECK(task.number == 5 && number->rvalue() == 5 && number->value() == 5);
  task.number = 6;
  CHECK(number->get() == 6);
}

void activities() {
  Task task("task", State::Stopped);
  CHECK(task.setActivity(new RTT::Activity(ORO_SCHED_OTHER, 0, 0.005, 0x1u, 0, "task")));
  CHECK(task.getPeriod() > 0.004 && task.getPeriod() < 0.006);
  task.start();
  CHECK(!task.setActivity(new RTT::extras::SlaveActivity(0.1)) && task.isRunning());
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  // What another task asks for is done by its thread.
  Requirer<int(int)> twice("twice");
  twice.requires()->connectTo(task.provides());
  const auto handle = twice.caller.send(4);
  int result = 0;
  RTT::SendStatus status = RTT::SendNotReady;
  for (int tries = 0; tries < 1000 && status == RTT::SendNotReady; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    status = handle.collectIfDone(result);
  }
  CHECK(status == RTT::SendSuccess && result == 8);
  CHECK(task.stop());
  const std::string hooks = task.take();
  CHECK(hooks.find("start update update") == 0);
  CHECK(hooks.rfind("stop") == hooks.size() - 4);
}

template <class Signature>
Signature* function(void* library, const char* name) {
  return reinterpret_cast<Signature*>(dlsym(library, name));
}

void component_libraries(const char* one, const char* several) {
  void* const first = dlopen(one, RTLD_NOW);
  void* const second = dlopen(several, RTLD_NOW);
  if (first == nullptr || second == nullptr) {
    CHECK(first != nullptr && second != nullptr);
    std::cerr << dlerror() << std::endl;
    return;
  }
  CHECK(function<std::string()>(first, "getComponentType")() == "one::Only");
  const std::unique_ptr<RTT::TaskContext> only(
      function<RTT::TaskContext*(std::string)>(first, "createComponent")("only"));
  CHECK(only->getName() == "only" && only->configure());

  const auto names = function<std::vector<std::string>()>(second, "getComponentTypeNames")();
  CHECK((names == std::vector<std::string>{"several::First", "several::Second"}));
  const auto create = function<RTT::TaskContext*(std::string, std::string)>(second, "createComponentType");
  const std::unique_ptr<RTT::TaskContext> created(create("created", "several::Second"));
  CHECK(created != nullptr && created->getName() == "created");
  CHECK(create("created", "several::Third") == nullptr);
}

}  // namespace

int ORO_main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "conformance: the two component libraries are missing" << std::endl;
    return 2;
  }
  unconnected_ports();
  data_connection();
  buffers();
  two_writers();
  lifecycle();
  exceptions();
  errors();
  operations();
  properties();
  activities();
  component_libraries(argv[1], argv[2]);
  std::cout << checks - failures << " of " << checks << " checks hold" << std::endl;
  return failures == 0 ? 0 : 1;
}
