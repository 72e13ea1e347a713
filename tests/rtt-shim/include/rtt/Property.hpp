#ifndef RTT_SHIM_PROPERTY_HPP
#define RTT_SHIM_PROPERTY_HPP

#include <string>

#include "rtt/base/PropertyBase.hpp"

namespace RTT {

class TaskContext;

// A property of a task, whose value is a member of the component.
template <class T>
class Property : public base::PropertyBase {
 public:
  Property(const Property&) = delete;
  Property& operator=(const Property&) = delete;

  Property& doc(const std::string& text) {
    doc_ = text;
    return *this;
  }

  const T& get() const { return value_; }
  void set(const T& value) { value_ = value; }
  T& value() { return value_; }
  const T& rvalue() const { return value_; }
  bool ready() const { return true; }

 private:
  friend class TaskContext;

  Property(const std::string& name, T& value) : base::PropertyBase(name), value_(value) {}

  T& value_;
  std::string doc_;
};

}  // namespace RTT

#endif
