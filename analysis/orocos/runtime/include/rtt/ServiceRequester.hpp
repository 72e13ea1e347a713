#ifndef MAUVE_RTT_SERVICE_REQUESTER_HPP
#define MAUVE_RTT_SERVICE_REQUESTER_HPP

#include <map>
#include <memory>
#include <string>

#include "rtt/OperationCaller.hpp"
#include "rtt/Service.hpp"

namespace RTT {

// The operations that a task requires.
class ServiceRequester {
 public:
  typedef std::shared_ptr<ServiceRequester> shared_ptr;

  explicit ServiceRequester(ExecutionEngine* caller) : caller_(caller) {}
  ServiceRequester(const ServiceRequester&) = delete;
  ServiceRequester& operator=(const ServiceRequester&) = delete;

  bool addOperationCaller(base::OperationCallerBaseInvoker& caller) {
    if (!callers_.emplace(caller.getName(), &caller).second) return false;
    caller.caller_ = caller_;
    return true;
  }

  // Connects each operation that has none yet to the one of its name. Are all connected?
  bool connectTo(const Service::shared_ptr& service) {
    for (const auto& caller : callers_) {
      const auto found = service->operations_.find(caller.first);
      if (!caller.second->ready() && found != service->operations_.end()) {
        caller.second->implement(found->second->part());
      }
    }
    return ready();
  }

  // Not in RTT: connects a required operation with a provided one of any name. False if one of them is not there, or if the
  // signatures differ.
  bool connect(const std::string& required, const Service::shared_ptr& service, const std::string& provided) {
    const auto caller = callers_.find(required);
    const auto found = service->operations_.find(provided);
    if (caller == callers_.end() || found == service->operations_.end()) return false;
    return caller->second->implement(found->second->part());
  }

  bool ready() const {
    for (const auto& caller : callers_) {
      if (!caller.second->ready()) return false;
    }
    return true;
  }

 private:
  ExecutionEngine* const caller_;
  std::map<std::string, base::OperationCallerBaseInvoker*> callers_;
};

}  // namespace RTT

#endif
