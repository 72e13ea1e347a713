// The domain of Cyclone DDS: its configuration, and its threads.

#ifndef MAUVE_ROS2_DOMAIN_HPP
#define MAUVE_ROS2_DOMAIN_HPP

#include <cstddef>
#include <functional>
#include <set>
#include <string>

#include "mauve/clock.hpp"
#include "mauve/cpus.hpp"
#include "mauve/ros2.hpp"

namespace mauve {

// Cyclone's threads have the priority below the gateway's, on its CPUs: a flood then delays no activity of greater priority.
struct MiddlewareScheduling {
  int priority;
  Cpus cpus;
};

// The number of the domain: that of ROS_DOMAIN_ID, if it is set. Throws where that is none.
int domain_number(int configured);

// What Cyclone reads. A priority of 0 leaves its threads to the system. What CYCLONEDDS_URI says comes last.
// Writers keep `unsent_bytes` before they refuse samples; the greatest sample of all topics has `max_bytes`.
std::string configuration(Ros2::Discovery discovery, int priority, std::size_t unsent_bytes, std::size_t max_bytes);

// Whether the user has chosen network interfaces in CYCLONEDDS_URI.
bool has_own_interface();

// Calls a function that opens sockets, which then hear the loopback alone: Cyclone opens those that it receives with to all interfaces.
// Throws where that cannot be, and what the function throws.
void on_loopback(const std::function<void()>& function);

// Whether this user may have threads of this priority.
bool may_have_priority(int priority);

// Calls a function that starts threads in one that is confined to some CPUs: so are they. Returns the numbers of the threads that have
// been started and are still there. Throws what the function throws.
std::set<int> confined(const Cpus& cpus, const std::function<void()>& function);

std::string name_of_thread(int number);

// What differs between a thread and what it should be; empty if nothing does.
std::string difference(int thread, const MiddlewareScheduling& wanted);

// The CPU time that a thread has used; and its priority from now on, 0 for SCHED_OTHER. Neither waits nor allocates.
Nanoseconds cpu_of(int thread);
void set_priority(int thread, int priority);

// While it exists, the calling thread is scheduled so, if it may be: what it holds, threads of this priority may wait for.
class Scheduled {
 public:
  explicit Scheduled(const MiddlewareScheduling& wanted);
  ~Scheduled();
  Scheduled(const Scheduled&) = delete;
  Scheduled& operator=(const Scheduled&) = delete;

 private:
  struct Before;
  Before* before_;
};

}  // namespace mauve

#endif
