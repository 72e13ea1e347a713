// Samples as Cyclone DDS keeps them: bytes, which the gateway alone encodes and decodes.

#ifndef MAUVE_ROS2_SAMPLES_HPP
#define MAUVE_ROS2_SAMPLES_HPP

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace mauve {

// What came of the samples that arrived on a topic, in the threads of Cyclone.
struct Arrivals {
  std::size_t max_bytes;
  std::atomic<std::uint64_t> accepted{0}, too_large{0};
};

// A type with this name, for dds_create_topic_sertype. Greater samples than `arrivals` allows are counted, and not copied.
ddsi_sertype* new_sample_type(const char* name, Arrivals& arrivals);

// A sample of this size; its bytes, which have to be written before it is given to Cyclone; null without memory.
ddsi_serdata* new_sample(const ddsi_sertype* type, std::size_t size);
char* bytes_of(ddsi_serdata* sample);
std::size_t size_of_sample(const ddsi_serdata* sample);

}  // namespace mauve

#endif
