// A lock for what codels share: a device, a buffer of a driver.

#ifndef MAUVE_LOCK_HPP
#define MAUVE_LOCK_HPP

#include <pthread.h>

#include "mauve/clock.hpp"

namespace mauve {

struct Context;

// Unlike std::mutex, this lock bounds how long a codel waits for one of lower priority. Who holds it has the priority of those that
// wait for it (PTHREAD_PRIO_INHERIT: protocol = "inheritance"), or always `ceiling`, the greatest priority of all that use it
// (PTHREAD_PRIO_PROTECT: protocol = "ceiling"). `name` is that of `[locks.NAME]` in mauve.toml, and stays valid.
//
//   mauve::Lock bus("bus");
//   int imu_read() {
//     const std::lock_guard<mauve::Lock> held(bus);
//     ...
//   }
//
// A recording has how long which codel held it, and for how long codels waited for it.
class Lock {
 public:
  explicit Lock(const char* name);
  Lock(const char* name, int ceiling);
  ~Lock();
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  // These throw std::system_error where the system refuses the lock: the thread has it already, has a greater priority than the
  // ceiling, or may not have that priority.
  void lock();
  bool try_lock();
  void unlock();

 private:
  Lock(const char* name, int protocol, int ceiling);
  void locked();

  pthread_mutex_t mutex_;
  const char* const name_;
  // Of the thread that holds the lock; nothing where the time is not recorded.
  Context* holder_ = nullptr;
  Nanoseconds began_ = 0;
  Nanoseconds cpu_before_ = 0;
};

}  // namespace mauve

#endif
