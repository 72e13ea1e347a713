#ifndef RTT_SHIM_OPERATION_BODY_HPP
#define RTT_SHIM_OPERATION_BODY_HPP

#include <functional>
#include <string>

#include "rtt/ExecutionEngine.hpp"

namespace RTT {

// Whose thread executes an operation.
enum ExecutionThread { OwnThread, ClientThread };

// An operation of a task, whatever its signature is.
class OperationInterfacePart {
 public:
  virtual ~OperationInterfacePart() {}

 protected:
  OperationInterfacePart() {}
};

namespace internal {

template <class Signature>
struct OperationBody : OperationInterfacePart {
  std::function<Signature> function;
  ExecutionEngine* owner = nullptr;
  ExecutionThread thread = ClientThread;
};

}  // namespace internal
}  // namespace RTT

#endif
