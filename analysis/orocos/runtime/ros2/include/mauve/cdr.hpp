// Writes and reads messages in XCDR1, the format of ROS 2's topics: little-endian, each number aligned to its size.
//
// The fields of a message are listed once, by a function that is found next to its type:
//
//   template <class Stream>
//   void visit(Stream& stream, Twist& message) {
//     stream(message.linear);
//     stream(message.angular);
//   }
//
// `stream(field, bound)` has a string of at most `bound` characters, or a sequence of at most `bound` elements;
// `stream(field, bound, text_bound)` a sequence or an array of bounded strings. A bound of 0 is none.

#ifndef MAUVE_CDR_HPP
#define MAUVE_CDR_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mauve {
namespace cdr {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "samples are written by little-endian computers");

// What says how the bytes after it are to be read. Alignments count from its end.
constexpr std::size_t header_size = 4;

template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t size>
struct IsArray<std::array<T, size>> : std::true_type {};

template <class T, class = void>
struct IsSequence : std::false_type {};
template <class T>
struct IsSequence<T, decltype(std::declval<T&>().resize(0))> : std::true_type {};

// A number, whose bytes are copied as they are.
template <class T>
struct IsNumber : std::integral_constant<bool, std::is_arithmetic<T>::value && !std::is_same<T, bool>::value> {};

// Calls the right function of a stream for each type of field.
template <class Derived>
class Stream {
 public:
  template <class T>
  void operator()(T& field, std::size_t bound = 0, std::size_t text_bound = 0) {
    put(field, bound, text_bound, IsNumber<T>(), IsArray<T>(), IsSequence<T>());
  }
  void operator()(bool& field, std::size_t = 0, std::size_t = 0) { self().flag(field); }
  void operator()(std::string& field, std::size_t bound = 0, std::size_t = 0) { self().text(field, bound); }
  // A message without fields has one byte.
  void empty() {
    std::uint8_t nothing = 0;
    self().numbers(&nothing, 1);
  }
  bool is_good() const { return is_good_; }

 protected:
  Derived& self() { return static_cast<Derived&>(*this); }

  template <class T>
  void elements(T* begin, std::size_t count, std::size_t text_bound, std::false_type) {
    for (std::size_t index = 0; index < count && is_good_; ++index) (*this)(begin[index], text_bound);
  }
  template <class T>
  void elements(T* begin, std::size_t count, std::size_t, std::true_type) {
    self().numbers(begin, count);
  }

  bool is_good_ = true;

 private:
  template <class T, class A, class S>
  void put(T& field, std::size_t, std::size_t, std::true_type, A, S) {
    self().numbers(&field, 1);
  }
  template <class T>
  void put(T& field, std::size_t, std::size_t text_bound, std::false_type, std::true_type, std::false_type) {
    elements(field.data(), field.size(), text_bound, IsNumber<typename T::value_type>());
  }
  template <class T>
  void put(T& field, std::size_t bound, std::size_t text_bound, std::false_type, std::false_type, std::true_type) {
    self().sequence(field, bound, text_bound);
  }
  template <class T>
  void put(T& field, std::size_t, std::size_t, std::false_type, std::false_type, std::false_type) {
    if (is_good_) visit(self(), field);
  }
};

// Writes into memory that is large enough; without memory, only counts the bytes. It is not good where a bound is exceeded.
class Writer : public Stream<Writer> {
 public:
  explicit Writer(char* to) : to_(to) {}
  std::size_t size() const { return size_; }

  template <class T>
  void numbers(const T* values, std::size_t count) {
    if (count == 0) return;
    const std::size_t begin = (size_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    if (to_ != nullptr) {
      std::memset(to_ + size_, 0, begin - size_);
      std::memcpy(to_ + begin, values, count * sizeof(T));
    }
    size_ = begin + count * sizeof(T);
  }
  void flag(bool value) {
    const std::uint8_t byte = value ? 1 : 0;
    numbers(&byte, 1);
  }
  // With its terminator.
  void text(const std::string& value, std::size_t bound) {
    if (is_within(value.size(), bound) && length(value.size() + 1)) numbers(value.c_str(), value.size() + 1);
  }
  template <class T>
  void sequence(T& values, std::size_t bound, std::size_t text_bound) {
    if (is_within(values.size(), bound) && length(values.size()) && !values.empty()) {
      put_all(values, text_bound, std::is_same<typename T::value_type, bool>());
    }
  }

 private:
  template <class T>
  void put_all(T& values, std::size_t text_bound, std::false_type) {
    elements(&values[0], values.size(), text_bound, IsNumber<typename T::value_type>());
  }
  // Without addresses: a vector has bits.
  template <class T>
  void put_all(T& values, std::size_t, std::true_type) {
    for (const bool value : values) flag(value);
  }
  bool is_within(std::size_t size, std::size_t bound) { return is_good_ = is_good_ && (bound == 0 || size <= bound); }
  bool length(std::size_t size) {
    const std::uint32_t written = static_cast<std::uint32_t>(size);
    is_good_ = written == size;
    numbers(&written, 1);
    return is_good_;
  }

  char* const to_;
  std::size_t size_ = 0;
};

// Reads what a stranger has written: no length is trusted, and nothing is allocated for elements that cannot be there. After something
// wrong it is not good, and the fields are undefined. An empty string has four bytes, and 32 in the memory: elements of sequences, other
// than numbers, take at most `room` bytes together; more are a std::bad_alloc.
class Reader : public Stream<Reader> {
 public:
  Reader(const char* from, std::size_t size, std::size_t room, bool is_big_endian)
      : from_(from), size_(size), room_(room), is_swapped_(is_big_endian) {}
  // Whether no more than the bytes that fill up the last four are left.
  bool is_at_end() const { return is_good_ && size_ - at_ < 4; }

  template <class T>
  void numbers(T* values, std::size_t count) {
    if (count == 0 || !has(count, sizeof(T))) return;
    std::memcpy(values, from_ + at_, count * sizeof(T));
    at_ += count * sizeof(T);
    if (!is_swapped_ || sizeof(T) == 1) return;
    for (std::size_t index = 0; index < count; ++index) {
      char* const bytes = reinterpret_cast<char*>(values + index);
      std::reverse(bytes, bytes + sizeof(T));
    }
  }
  void flag(bool& value) {
    std::uint8_t byte = 0;
    numbers(&byte, 1);
    is_good_ = is_good_ && byte <= 1;
    value = byte == 1;
  }
  void text(std::string& value, std::size_t bound) {
    // A terminator at least; but some write an empty string as nothing.
    const std::size_t size = length(bound == 0 ? 0 : bound + 1);
    if (!has(size, 1)) return;
    is_good_ = size == 0 || from_[at_ + size - 1] == '\0';
    if (is_good_) value.assign(from_ + at_, size == 0 ? 0 : size - 1);
    at_ += size;
  }
  template <class T>
  void sequence(T& values, std::size_t bound, std::size_t text_bound) {
    fill(values, length(bound), text_bound, IsNumber<typename T::value_type>(), std::is_same<typename T::value_type, bool>());
  }

 private:
  template <class T>
  void fill(T& values, std::size_t size, std::size_t, std::true_type, std::false_type) {
    if (size > 0 && !has(size, sizeof(typename T::value_type))) return;
    if (!is_good_) return;
    values.resize(size);
    if (size > 0) numbers(&values[0], size);
  }
  template <class T>
  void fill(T& values, std::size_t size, std::size_t, std::false_type, std::true_type) {
    if (!has(size, 1)) return;
    values.resize(size);
    for (std::size_t index = 0; index < size; ++index) {
      bool value = false;
      flag(value);
      values[index] = value;
    }
  }
  // Each element has a byte at least.
  template <class T>
  void fill(T& values, std::size_t size, std::size_t text_bound, std::false_type, std::false_type) {
    constexpr std::size_t each = sizeof(typename T::value_type);
    if (!has(size, 1)) return;
    if (size > room_ / each) throw std::bad_alloc();
    room_ -= size * each;
    values.resize(size);
    if (size > 0) elements(&values[0], size, text_bound, std::false_type());
  }
  // Whether this many numbers of this size are left. Skips the bytes before them.
  bool has(std::size_t count, std::size_t size) {
    const std::size_t begin = (at_ + size - 1) / size * size;
    is_good_ = is_good_ && begin <= size_ && count <= (size_ - begin) / size;
    if (is_good_) at_ = begin;
    return is_good_;
  }
  std::size_t length(std::size_t bound) {
    std::uint32_t size = 0;
    numbers(&size, 1);
    is_good_ = is_good_ && (bound == 0 || size <= bound);
    return is_good_ ? size : 0;
  }

  const char* const from_;
  const std::size_t size_;
  std::size_t room_;
  const bool is_swapped_;
  std::size_t at_ = 0;
};

// The size of a message with its header; 0 where a bound is exceeded.
template <class Message>
std::size_t size(const Message& message) {
  Writer writer(nullptr);
  // A writer changes nothing: one `visit` serves all streams.
  writer(const_cast<Message&>(message));
  return writer.is_good() ? header_size + writer.size() : 0;
}

// Writes a message into memory of its size, and its header.
template <class Message>
void write(const Message& message, char* to) {
  const char header[header_size] = {0, 1, 0, 0};
  std::memcpy(to, header, header_size);
  Writer writer(to + header_size);
  writer(const_cast<Message&>(message));
}

// Reads a message with its header, whose sequences have so much `room`. False where it is malformed; the message is undefined then.
template <class Message>
bool read(const char* from, std::size_t size, std::size_t room, Message& message) {
  if (size < header_size || from[0] != 0 || (from[1] != 0 && from[1] != 1)) return false;
  Reader reader(from + header_size, size - header_size, room, from[1] == 0);
  reader(message);
  return reader.is_at_end();
}

}  // namespace cdr
}  // namespace mauve

#endif
