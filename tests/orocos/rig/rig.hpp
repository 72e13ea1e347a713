// Runs one component: ticks, inputs, operations that others call, operations that it calls. What happens when is drawn from a
// seed, so that an interpreter can do the same.

#ifndef RIG_RIG_HPP
#define RIG_RIG_HPP

#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <rtt/ConnPolicy.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/Operation.hpp>
#include <rtt/OperationCaller.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/Property.hpp>
#include <rtt/TaskContext.hpp>
#include <rtt/extras/SlaveActivity.hpp>

#include "library.hpp"
#include "recorder.hpp"

namespace rig {

template <class T>
struct IsOut : std::integral_constant<bool, std::is_lvalue_reference<T>::value &&
                                                !std::is_const<std::remove_reference_t<T>>::value> {};

template <class T>
using Bare = std::remove_const_t<std::remove_reference_t<T>>;

inline void show_outs(std::vector<std::string>&) {}

// Of the arguments that `A` are the types of, those that come back.
template <class... A>
struct Outs;

template <>
struct Outs<> {
  static void draw(Random&) {}
  static void show(std::vector<std::string>&) {}
};

template <class First, class... Rest>
struct Outs<First, Rest...> {
  static void draw(Random& random, Bare<First>& first, Bare<Rest>&... rest) {
    if (IsOut<First>::value) rig::draw(random, first);
    Outs<Rest...>::draw(random, rest...);
  }
  static void show(std::vector<std::string>& shown, const Bare<First>& first, const Bare<Rest>&... rest) {
    if (IsOut<First>::value) shown.push_back(rig::show(first));
    Outs<Rest...>::show(shown, rest...);
  }
};

// An operation that the rig provides: what it is given and gives is written down. Which of its arguments come in, a C++ type
// does not say: `way` has a letter for each, `i`, `o` or `b` for both.
template <class Signature>
class Served;

template <class R>
struct Result {
  static R draw(std::vector<std::string>& shown) {
    const R result = drawn<R>(results());
    shown.push_back(show(result));
    return result;
  }
};

template <>
struct Result<void> {
  static void draw(std::vector<std::string>&) {}
};

inline void show_ins(std::vector<std::string>&, const char*) {}

template <class First, class... Rest>
void show_ins(std::vector<std::string>& shown, const char* way, const First& first, const Rest&... rest) {
  if (*way != 'o') shown.push_back(show(first));
  show_ins(shown, way + 1, rest...);
}

template <class R, class... A>
class Served<R(A...)> {
 public:
  Served(const std::string& name, const std::string& way) : name_(name), way_(way) {}

  R call(A... arguments) {
    std::vector<std::string> ins;
    show_ins(ins, way_.c_str(), arguments...);
    std::vector<std::string> shown;
    return finish(std::is_void<R>(), join(ins), shown, arguments...);
  }

 private:
  template <class... B>
  R finish(std::true_type, const std::string& ins, std::vector<std::string>& shown, B&... arguments) {
    give(ins, shown, arguments...);
  }

  template <class... B>
  R finish(std::false_type, const std::string& ins, std::vector<std::string>& shown, B&... arguments) {
    const R result = Result<R>::draw(shown);
    give(ins, shown, arguments...);
    return result;
  }

  template <class... B>
  void give(const std::string& ins, std::vector<std::string>& shown, B&... arguments) {
    Draws<A...>::draw(arguments...);
    Outs<A...>::show(shown, arguments...);
    line("served " + name_ + "(" + ins + ") -> " + join(shown));
  }

  template <class... B>
  struct Draws {
    static void draw() {}
  };
  template <class First, class... Rest>
  struct Draws<First, Rest...> {
    template <class Value, class... Values>
    static void draw(Value& value, Values&... values) {
      one(IsOut<First>(), value);
      Draws<Rest...>::draw(values...);
    }
    template <class Value>
    static void one(std::true_type, Value& value) {
      rig::draw(results(), value);
    }
    template <class Value>
    static void one(std::false_type, Value&) {}
  };

  const std::string name_;
  const std::string way_;
};

// An operation of the component, as another one calls it.
class Asked {
 public:
  virtual ~Asked() {}
  virtual void send_sometimes(Random& random) = 0;
  virtual void collect() = 0;
};

template <class Signature>
class AskedFor;

template <class R, class... A>
class AskedFor<R(A...)> : public Asked {
 public:
  AskedFor(RTT::TaskContext& asking, const std::string& name, const std::string& way)
      : caller_(name), way_(way) {
    asking.requires()->addOperationCaller(caller_);
  }

  void send_sometimes(Random& random) override {
    if (is_sent_ || random.below(4) != 0) return;
    send(random, std::index_sequence_for<A...>());
  }

  // What does not run refuses: RTT throws here.
  void collect() override {
    if (!is_sent_) return;
    try {
      collect_from(std::is_void<R>(), std::index_sequence_for<A...>());
    } catch (const std::exception&) {
      line("refused " + caller_.getName());
      is_sent_ = false;
    }
  }

 private:
  template <std::size_t... I>
  void send(Random& random, std::index_sequence<I...>) {
    // What only comes out is nothing before.
    const int all[] = {0, (begin(random, I, std::get<I>(arguments_)), 0)...};
    static_cast<void>(all);
    handle_ = caller_.send(std::get<I>(arguments_)...);
    is_sent_ = true;
  }

  template <class T>
  void begin(Random& random, std::size_t index, T& value) {
    value = T();
    if (way_[index] != 'o') draw(random, value);
  }

  template <std::size_t... I>
  void collect_from(std::true_type, std::index_sequence<I...> all) {
    finish(collect_outs(all), {}, all);
  }

  template <std::size_t... I>
  void collect_from(std::false_type, std::index_sequence<I...> all) {
    Bare<std::conditional_t<std::is_void<R>::value, int, R>> result = {};
    const RTT::SendStatus status = collect_outs(all, result);
    finish(status, {show(result)}, all);
  }

  // The arguments that come back have been changed where they are: they are collected into others.
  template <std::size_t... I, class... Before>
  RTT::SendStatus collect_outs(std::index_sequence<I...>, Before&... before) {
    return gather(std::integral_constant<std::size_t, 0>(), before...);
  }

  template <class... Out>
  RTT::SendStatus gather(std::integral_constant<std::size_t, sizeof...(A)>, Out&... out) {
    return handle_.collectIfDone(out...);
  }

  template <std::size_t I, class... Out, class = std::enable_if_t<(I < sizeof...(A))>>
  RTT::SendStatus gather(std::integral_constant<std::size_t, I>, Out&... out) {
    typedef std::tuple_element_t<I, std::tuple<A...>> Argument;
    return gather_one<I>(IsOut<Argument>(), out...);
  }

  template <std::size_t I, class... Out>
  RTT::SendStatus gather_one(std::false_type, Out&... out) {
    return gather(std::integral_constant<std::size_t, I + 1>(), out...);
  }

  template <std::size_t I, class... Out>
  RTT::SendStatus gather_one(std::true_type, Out&... out) {
    return gather(std::integral_constant<std::size_t, I + 1>(), out..., std::get<I>(collected_));
  }

  template <std::size_t... I>
  void finish(RTT::SendStatus status, std::vector<std::string> shown, std::index_sequence<I...>) {
    if (status == RTT::SendNotReady) {
      line("waits for " + caller_.getName());
      return;
    }
    Outs<A...>::show(shown, std::get<I>(collected_)...);
    line("done " + caller_.getName() + " " + std::to_string(status) + " -> " + join(shown));
    is_sent_ = false;
  }

  RTT::OperationCaller<R(A...)> caller_;
  const std::string way_;
  std::tuple<Bare<A>...> arguments_;
  std::tuple<Bare<A>...> collected_;
  RTT::SendHandle<R(A...)> handle_;
  bool is_sent_ = false;
};

// What scripts know something by: no name begins with a `_` there.
inline std::string at_run_time(const std::string& name) {
  return name[0] == '_' ? "mal_" + name : name;
}

// What scripts know something by whose name they use otherwise.
inline std::string reserved(const std::string& name) {
  return at_run_time(name) + "_";
}

class Rig {
 public:
  Rig(const ComponentLibrary& library, const std::string& component, std::uint64_t seed)
      : random_(seed), other_("other") {
    results() = Random(~seed);
    line("== " + component);
    const std::string end = "::" + component;
    for (const std::string& type : library.types()) {
      const bool is_it = type.size() >= end.size() && type.compare(type.size() - end.size(), end.size(), end) == 0;
      if (is_it) task_ = library.create(type, component);
    }
    if (!task_) throw std::runtime_error("no component " + component);
    activity_ = new RTT::extras::SlaveActivity(0.1);
    task_->setActivity(activity_);
    others_activity_ = new RTT::extras::SlaveActivity(0.1);
    other_.setActivity(others_activity_);
  }

  ~Rig() {
    task_->stop();
    task_.reset();
  }

  // A size of 0: a connection without a buffer; below 0: none.
  template <class T>
  void input(const std::string& name, int size) {
    const auto output = std::make_shared<RTT::OutputPort<T>>("to_" + name);
    if (size >= 0) connect(*output, name, size);
    inputs_.push_back([this, output] {
      for (std::uint64_t count = random_.below(3); count > 0; --count) output->write(drawn<T>(random_));
    });
  }

  template <class T>
  void output(const std::string& name) {
    const auto input = std::make_shared<RTT::InputPort<T>>("from_" + name);
    connect(*input, name, 1000);
    outputs_.push_back([input, name] {
      T value;
      while (input->read(value, false) == RTT::NewData) line("out " + name + " " + show(value));
    });
  }

  // The value that it gets, and the one that it gets later.
  template <class T>
  void property(const std::string& name, const T& first, const T& later) {
    RTT::base::PropertyBase* const plain = task_->getProperty(at_run_time(name));
    RTT::base::PropertyBase* const found = plain == nullptr ? task_->getProperty(reserved(name)) : plain;
    RTT::Property<T>* const property = dynamic_cast<RTT::Property<T>*>(found);
    if (property == nullptr) throw std::runtime_error("no property " + name);
    property->set(first);
    properties_.push_back([property, later] { property->set(later); });
  }

  template <class Signature>
  void provided(const std::string& name, const std::string& way) {
    asked_.emplace_back(new AskedFor<Signature>(other_, at_run_time(name), way));
  }

  template <class Signature>
  void required(const std::string& name, const std::string& way) {
    const auto served = std::make_shared<Served<Signature>>(name, way);
    other_.addOperation(at_run_time(name), &Served<Signature>::call, served.get(), RTT::OwnThread);
    served_.push_back(served);
  }

  void go(int ticks) {
    task_->requires()->connectTo(other_.provides());
    if (!asked_.empty() && !other_.requires()->connectTo(task_->provides())) {
      throw std::runtime_error("an operation is not there, or is another");
    }
    for (int tick = 0; tick < ticks; ++tick) {
      line("tick " + std::to_string(tick));
      if (tick == 3) {
        for (const auto& property : properties_) property();
      }
      live();
      for (const auto& input : inputs_) input();
      for (const auto& asked : asked_) asked->send_sometimes(random_);
      if (random_.below(2) == 0) others_activity_->execute();
      activity_->execute();
      for (const auto& output : outputs_) output();
      for (const auto& asked : asked_) asked->collect();
    }
  }

 private:
  template <class P>
  void connect(P& port, const std::string& name, int size) {
    RTT::base::PortInterface* const plain = task_->getPort(at_run_time(name));
    RTT::base::PortInterface* const other = plain == nullptr ? task_->getPort(reserved(name)) : plain;
    const RTT::ConnPolicy policy = size == 0 ? RTT::ConnPolicy::data() : RTT::ConnPolicy::circularBuffer(size);
    if (other == nullptr || !port.connectTo(other, policy)) throw std::runtime_error("no port " + name);
  }

  // It is stopped now and then, and started again.
  void live() {
    if (task_->isRunning()) {
      if (random_.below(10) != 0) return;
      line("stop " + show(task_->stop()));
      if (random_.below(2) == 0) line("cleanup " + show(task_->cleanup()));
      return;
    }
    if (!task_->isConfigured()) {
      if (random_.below(3) == 0) return;
      line("configure " + show(task_->configure()));
    }
    if (task_->isConfigured()) line("start " + show(task_->start()));
  }

  Random random_;
  RTT::TaskContext other_;
  std::unique_ptr<RTT::TaskContext> task_;
  RTT::extras::SlaveActivity* activity_;
  RTT::extras::SlaveActivity* others_activity_;
  std::vector<std::function<void()>> inputs_, outputs_, properties_;
  std::vector<std::unique_ptr<Asked>> asked_;
  std::vector<std::shared_ptr<void>> served_;
};

// Runs components of the library that is the first argument: one after the other, or with a second argument all at once, each in a
// thread. Their lines are the same, and follow each other component by component.
inline int run_components(int argc, char** argv, const std::vector<void (*)(const ComponentLibrary&)>& components) {
  if (argc != 2 && argc != 3) return 2;
  std::vector<std::string> lines(components.size());
  std::vector<std::string> problems(components.size());
  const ComponentLibrary library(argv[1]);
  const auto run = [&](std::size_t number) {
    if (argc == 3) keep_lines(lines[number]);
    try {
      components[number](library);
    } catch (const std::exception& thrown) {
      problems[number] = thrown.what();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t number = 0; number < components.size(); ++number) {
    if (argc == 3) {
      threads.emplace_back(run, number);
    } else {
      run(number);
    }
  }
  for (std::thread& thread : threads) thread.join();
  int result = 0;
  for (std::size_t number = 0; number < components.size(); ++number) {
    std::cout << lines[number];
    if (problems[number].empty()) continue;
    std::cerr << problems[number] << std::endl;
    result = 1;
  }
  return result;
}

}  // namespace rig

#endif
