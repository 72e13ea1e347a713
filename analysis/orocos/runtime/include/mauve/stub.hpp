// The results of codels that have not been written.

#ifndef MAUVE_STUB_HPP
#define MAUVE_STUB_HPP

#include <cstdint>
#include <type_traits>

namespace mauve {

// A number that looks random: of each thread, the same ones in each run. Outside of the threads of activities it is 0, so that
// stubs called by `configure` and `start` succeed.
std::uint64_t stub_number();

namespace detail {

template <class T>
void fill(T& value, std::true_type) {
  // Mostly true and small: that lets most machines move on.
  const std::uint64_t number = stub_number();
  value = std::is_same<T, bool>::value ? static_cast<T>(number % 8 != 7) : static_cast<T>(number % 100);
}

// Pointers, texts and messages stay as they are.
template <class T>
void fill(T&, std::false_type) {}

}  // namespace detail

// Gives a parameter of a stub a value.
template <class T>
void stub(T& value) {
  detail::fill(value, std::is_arithmetic<T>());
}

// Returns a result of a stub.
template <class T>
T stub() {
  T value{};
  detail::fill(value, std::is_arithmetic<T>());
  return value;
}

}  // namespace mauve

#endif
