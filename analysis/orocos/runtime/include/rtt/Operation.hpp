#ifndef MAUVE_RTT_OPERATION_HPP
#define MAUVE_RTT_OPERATION_HPP

#include <memory>
#include <string>

#include "rtt/internal/OperationBody.hpp"

namespace RTT {

class TaskContext;

namespace internal {

class OperationBase {
 public:
  virtual ~OperationBase() {}
  virtual const std::shared_ptr<OperationInterfacePart>& part() const = 0;
};

}  // namespace internal

template <class Signature>
class Operation : public internal::OperationBase {
 public:
  Operation(const Operation&) = delete;
  Operation& operator=(const Operation&) = delete;

  Operation& doc(const std::string&) { return *this; }
  Operation& arg(const std::string&, const std::string&) { return *this; }

 private:
  friend class TaskContext;

  explicit Operation(std::shared_ptr<OperationInterfacePart> part) : part_(std::move(part)) {}
  const std::shared_ptr<OperationInterfacePart>& part() const override { return part_; }

  const std::shared_ptr<OperationInterfacePart> part_;
};

}  // namespace RTT

#endif
