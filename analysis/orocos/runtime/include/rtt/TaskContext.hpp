#ifndef MAUVE_RTT_TASK_CONTEXT_HPP
#define MAUVE_RTT_TASK_CONTEXT_HPP

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rtt/ExecutionEngine.hpp"
#include "rtt/InputPort.hpp"
#include "rtt/Operation.hpp"
#include "rtt/OperationCaller.hpp"
#include "rtt/OutputPort.hpp"
#include "rtt/Property.hpp"
#include "rtt/Service.hpp"
#include "rtt/ServiceRequester.hpp"
#include "rtt/base/PortInterface.hpp"
#include "rtt/base/PropertyBase.hpp"
#include "rtt/base/TaskCore.hpp"

namespace RTT {

// A component. It has no activity until it is given one: nothing happens before.
class TaskContext : public base::TaskCore {
 public:
  TaskContext(const std::string& name, TaskState initial_state = Stopped)
      : base::TaskCore(initial_state),
        name_(name),
        provided_(std::make_shared<Service>()),
        required_(std::make_shared<ServiceRequester>(engine())) {}

  ~TaskContext() override {
    if (activity_) activity_->stop();
    set_engine_activity(nullptr);
    engine()->abandon_messages();
  }

  const std::string& getName() const { return name_; }

  // The activity is the task's from now on, and is started.
  bool setActivity(base::ActivityInterface* activity) {
    if (isRunning()) return false;
    if (activity_) activity_->stop();
    set_engine_activity(activity);
    activity_.reset(activity);
    if (activity == nullptr) return true;
    activity->stop();
    activity->run(engine());
    return activity->start();
  }

  // By its name; null without one.
  TaskContext* getPeer(const std::string& name) const {
    const auto found = peers_.find(name);
    return found == peers_.end() ? nullptr : found->second;
  }
  bool addPeer(TaskContext* peer) { return peers_.emplace(peer->getName(), peer).second; }

  Service::shared_ptr provides() { return provided_; }
  ServiceRequester::shared_ptr requires() { return required_; }
  ServiceRequester::shared_ptr requires(const std::string& service) {
    ServiceRequester::shared_ptr& requester = services_[service];
    if (!requester) requester = std::make_shared<ServiceRequester>(engine());
    return requester;
  }

  base::PortInterface& addPort(const std::string& name, base::PortInterface& port) {
    port.name_ = name;
    ports_[name] = &port;
    return port;
  }

  base::PortInterface* getPort(const std::string& name) const {
    const auto found = ports_.find(name);
    return found == ports_.end() ? nullptr : found->second;
  }

  template <class T>
  Property<T>& addProperty(const std::string& name, T& value) {
    Property<T>* const property = new Property<T>(name, value);
    properties_[name].reset(property);
    return *property;
  }

  base::PropertyBase* getProperty(const std::string& name) const {
    const auto found = properties_.find(name);
    return found == properties_.end() ? nullptr : found->second.get();
  }

  // Not in RTT: the names of the properties.
  std::vector<std::string> propertyNames() const {
    std::vector<std::string> names;
    for (const auto& property : properties_) names.push_back(property.first);
    return names;
  }

  template <class R, class C, class S, class... A>
  Operation<R(A...)>& addOperation(const std::string name, R (C::*function)(A...), S* owner,
                                   ExecutionThread thread = ClientThread) {
    C* const object = owner;
    return add<R, A...>(name, [=](A... arguments) -> R { return (object->*function)(arguments...); }, thread);
  }

  template <class R, class C, class S, class... A>
  Operation<R(A...)>& addOperation(const std::string name, R (C::*function)(A...) const, S* owner,
                                   ExecutionThread thread = ClientThread) {
    const C* const object = owner;
    return add<R, A...>(name, [=](A... arguments) -> R { return (object->*function)(arguments...); }, thread);
  }

  OperationInterfacePart* getOperation(const std::string& name) const {
    const auto found = provided_->operations_.find(name);
    return found == provided_->operations_.end() ? nullptr : found->second->part().get();
  }

 private:

  template <class R, class... A, class F>
  Operation<R(A...)>& add(const std::string& name, F function, ExecutionThread thread) {
    const auto body = std::make_shared<internal::OperationBody<R(A...)>>();
    body->function = function;
    body->owner = engine();
    body->thread = thread;
    Operation<R(A...)>* const operation = new Operation<R(A...)>(body);
    provided_->operations_[name].reset(operation);
    return *operation;
  }

  const std::string name_;
  std::unique_ptr<base::ActivityInterface> activity_;
  const Service::shared_ptr provided_;
  const ServiceRequester::shared_ptr required_;
  std::map<std::string, ServiceRequester::shared_ptr> services_;
  std::map<std::string, base::PortInterface*> ports_;
  std::map<std::string, TaskContext*> peers_;
  std::map<std::string, std::unique_ptr<base::PropertyBase>> properties_;
};

}  // namespace RTT

#endif
