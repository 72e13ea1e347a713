#ifndef MAUVE_RTT_PROPERTY_BASE_HPP
#define MAUVE_RTT_PROPERTY_BASE_HPP

#include <string>

namespace RTT {
namespace base {

class PropertyBase {
 public:
  virtual ~PropertyBase() {}
  const std::string& getName() const { return name_; }

  // Not in RTT: sets a number, a Boolean or a text. False, and nothing is set, if the text is no value of its type.
  virtual bool setText(const std::string& text) = 0;

 protected:
  explicit PropertyBase(const std::string& name) : name_(name) {}

 private:
  std::string name_;
};

}  // namespace base
}  // namespace RTT

#endif
