#ifndef MAUVE_CPUS_HPP
#define MAUVE_CPUS_HPP

#include <bitset>
#include <cstddef>
#include <initializer_list>

namespace mauve {

// A set of CPUs, which are counted from 0: a bit each. A number is a set, too: 0x5 is CPUs 0 and 2.
typedef std::bitset<128> Cpus;

// The set of these CPUs.
inline Cpus cpus(std::initializer_list<std::size_t> numbers) {
  Cpus set;
  for (const std::size_t number : numbers) set.set(number);
  return set;
}

}  // namespace mauve

#endif
