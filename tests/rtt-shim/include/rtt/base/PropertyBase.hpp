#ifndef RTT_SHIM_PROPERTY_BASE_HPP
#define RTT_SHIM_PROPERTY_BASE_HPP

#include <string>

namespace RTT {
namespace base {

class PropertyBase {
 public:
  virtual ~PropertyBase() {}
  const std::string& getName() const { return name_; }

 protected:
  explicit PropertyBase(const std::string& name) : name_(name) {}

 private:
  std::string name_;
};

}  // namespace base
}  // namespace RTT

#endif
