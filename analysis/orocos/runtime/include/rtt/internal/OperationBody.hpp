#ifndef MAUVE_RTT_OPERATION_BODY_HPP
#define MAUVE_RTT_OPERATION_BODY_HPP

#include <functional>
#include <memory>
#include <vector>

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
class SentCalls;

template <class Signature>
struct OperationBody : OperationInterfacePart {
  std::function<Signature> function;
  ExecutionEngine* owner = nullptr;
  ExecutionThread thread = ClientThread;
  // Of each caller.
  std::vector<std::shared_ptr<SentCalls<Signature>>> calls;
};

}  // namespace internal
}  // namespace RTT

#endif
