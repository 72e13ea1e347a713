#ifndef MAUVE_RTT_PROPERTY_HPP
#define MAUVE_RTT_PROPERTY_HPP

#include <limits>
#include <locale>
#include <sstream>
#include <string>
#include <type_traits>

#include "rtt/base/PropertyBase.hpp"

namespace RTT {

class TaskContext;

namespace internal {

// Reads a whole text as a value; the overloads are for the types that models have.
inline bool parse(const std::string& text, std::string& value) {
  value = text;
  return true;
}

inline bool parse(const std::string& text, bool& value) {
  if (text != "true" && text != "false") return false;
  value = text == "true";
  return true;
}

template <class Number>
bool parse_with(const std::string& text, Number& number) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  return !text.empty() && text[0] != ' ' && in >> number && in.eof();
}

template <class T>
typename std::enable_if<std::is_floating_point<T>::value, bool>::type parse(const std::string& text, T& value) {
  double number = 0;
  if (!parse_with(text, number)) return false;
  value = static_cast<T>(number);
  return true;
}

template <class T>
typename std::enable_if<std::is_integral<T>::value, bool>::type parse(const std::string& text, T& value) {
  typedef std::numeric_limits<T> Limits;
  if (!text.empty() && text[0] == '-') {
    long long number = 0;
    if (!parse_with(text, number) || number < static_cast<long long>(Limits::min())) return false;
    value = static_cast<T>(number);
  } else {
    unsigned long long number = 0;
    if (!parse_with(text, number) || number > static_cast<unsigned long long>(Limits::max())) return false;
    value = static_cast<T>(number);
  }
  return true;
}

template <class T>
typename std::enable_if<!std::is_arithmetic<T>::value, bool>::type parse(const std::string&, T&) {
  return false;
}

}  // namespace internal

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
  bool setText(const std::string& text) override { return internal::parse(text, value_); }

 private:
  friend class TaskContext;

  Property(const std::string& name, T& value) : base::PropertyBase(name), value_(value) {}

  T& value_;
  std::string doc_;
};

}  // namespace RTT

#endif
