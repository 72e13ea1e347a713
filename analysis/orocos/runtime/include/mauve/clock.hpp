#ifndef MAUVE_CLOCK_HPP
#define MAUVE_CLOCK_HPP

#include <cstdint>

namespace mauve {

typedef std::int64_t Nanoseconds;

// Later than every instant.
constexpr Nanoseconds never = INT64_MAX;

// The time since an unknown instant: that of the computer's monotonic clock, or of the virtual clock.
Nanoseconds now();

// The CPU time that the calling thread has used; on the virtual clock, its virtual execution time.
Nanoseconds cpu_time();

// Lets 100 µs pass. Not in real-time threads.
void pause();

}  // namespace mauve

#endif
