// {generated}
//
// A lock for what codels share: a device, a buffer of a driver.

#pragma once

#ifdef MAUVE_RUNTIME

#include <mauve/lock.hpp>

namespace {lib} {

using MauveLock = ::mauve::Lock;

}  // namespace {lib}

#else

#include <errno.h>
#include <pthread.h>
#include <stdint.h>
#include <time.h>

#include <string>
#include <system_error>

extern "C" {
// Of the library of the components, if that is built with MAUVE_TRACING.
__attribute__((weak)) bool mauve_{lib}_records_locks(void);
__attribute__((weak)) uint64_t mauve_{lib}_waits(void);
__attribute__((weak)) void mauve_{lib}_lock(
    const char* lock, uint64_t cpu, uint64_t elapsed_ns, uint64_t blocked_ns, uint64_t waits);
}

namespace {lib} {

// Unlike std::mutex, this lock bounds how long a codel waits for one of lower priority. Who holds it has
// the priority of those that wait for it (protocol = "inheritance"), or always `ceiling`, the greatest
// priority of all that use it (protocol = "ceiling"). `name` is that of [locks.NAME] in mauve.toml, and
// stays valid.
//
//   {lib}::MauveLock bus("bus");
//   const std::lock_guard<{lib}::MauveLock> held(bus);
//
// These functions throw std::system_error where the system refuses the lock: the thread has it already,
// has a greater priority than the ceiling, or may not have that priority.
class MauveLock {
 public:
  explicit MauveLock(const char* name) : MauveLock(name, PTHREAD_PRIO_INHERIT, 0) {}
  MauveLock(const char* name, int ceiling) : MauveLock(name, PTHREAD_PRIO_PROTECT, ceiling) {}
  ~MauveLock() { pthread_mutex_destroy(&mutex_); }
  MauveLock(const MauveLock&) = delete;
  MauveLock& operator=(const MauveLock&) = delete;

  void lock() {
    if (try_lock()) return;
    if (!is_traced()) {
      check(pthread_mutex_lock(&mutex_));
      locked(0, 0);
      return;
    }
    const uint64_t waits_before = mauve_{lib}_waits();
    const uint64_t began = now(CLOCK_MONOTONIC), cpu_before = now(CLOCK_THREAD_CPUTIME_ID);
    check(pthread_mutex_lock(&mutex_));
    const uint64_t elapsed = now(CLOCK_MONOTONIC) - began;
    const uint64_t cpu = now(CLOCK_THREAD_CPUTIME_ID) - cpu_before;
    locked(elapsed > cpu ? elapsed - cpu : 0, mauve_{lib}_waits() - waits_before);
  }

  bool try_lock() {
    const int error = pthread_mutex_trylock(&mutex_);
    if (error == EBUSY) return false;
    check(error);
    locked(0, 0);
    return true;
  }

  void unlock() {
    const bool is_recorded = is_recorded_;
    const uint64_t cpu = is_recorded ? now(CLOCK_THREAD_CPUTIME_ID) - cpu_before_ : 0;
    const uint64_t elapsed = is_recorded ? now(CLOCK_MONOTONIC) - began_ : 0;
    const uint64_t blocked = blocked_, waits = waits_;
    check(pthread_mutex_unlock(&mutex_));
    if (is_recorded) mauve_{lib}_lock(name_, cpu, elapsed, blocked, waits);
  }

 private:
  MauveLock(const char* name, int protocol, int ceiling) : name_(name) {
    pthread_mutexattr_t attributes;
    check(pthread_mutexattr_init(&attributes));
    int error = pthread_mutexattr_setprotocol(&attributes, protocol);
    if (error == 0 && protocol == PTHREAD_PRIO_PROTECT) {
      error = pthread_mutexattr_setprioceiling(&attributes, ceiling);
    }
    // A thread that locks it twice gets an error, and does not wait for itself.
    if (error == 0) error = pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ERRORCHECK);
    if (error == 0) error = pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
    check(error);
  }

  void check(int error) const {
    if (error != 0) {
      throw std::system_error(error, std::system_category(), std::string("lock ") + name_);
    }
  }

  static bool is_traced() {
    return mauve_{lib}_records_locks != nullptr && mauve_{lib}_records_locks();
  }

  static uint64_t now(clockid_t clock) {
    timespec time = {};
    clock_gettime(clock, &time);
    return static_cast<uint64_t>(time.tv_sec) * 1000000000u + static_cast<uint64_t>(time.tv_nsec);
  }

  void locked(uint64_t blocked, uint64_t waits) {
    is_recorded_ = is_traced();
    if (!is_recorded_) return;
    blocked_ = blocked;
    waits_ = waits;
    began_ = now(CLOCK_MONOTONIC);
    cpu_before_ = now(CLOCK_THREAD_CPUTIME_ID);
  }

  pthread_mutex_t mutex_;
  const char* const name_;
  // Of the thread that holds the lock.
  bool is_recorded_ = false;
  uint64_t began_ = 0, cpu_before_ = 0, blocked_ = 0, waits_ = 0;
};

}  // namespace {lib}

#endif
