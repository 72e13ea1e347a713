#ifndef MAUVE_RTT_SERVICE_HPP
#define MAUVE_RTT_SERVICE_HPP

#include <map>
#include <memory>
#include <string>

#include "rtt/Operation.hpp"

namespace RTT {

class ServiceRequester;

// The operations that a task provides.
class Service {
 public:
  typedef std::shared_ptr<Service> shared_ptr;

  Service() {}
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

 private:
  friend class ServiceRequester;
  friend class TaskContext;

  std::map<std::string, std::unique_ptr<internal::OperationBase>> operations_;
};

}  // namespace RTT

#endif
