#include "mauve/lock.hpp"

#include <errno.h>

#include <string>
#include <system_error>

#include "context.hpp"
#include "timeline.hpp"

namespace mauve {
namespace {

void check(int error, const char* name) {
  if (error != 0) throw std::system_error(error, std::system_category(), std::string("lock ") + name);
}

}  // namespace

Lock::Lock(const char* name) : Lock(name, PTHREAD_PRIO_INHERIT, 0) {}
Lock::Lock(const char* name, int ceiling) : Lock(name, PTHREAD_PRIO_PROTECT, ceiling) {}

Lock::Lock(const char* name, int protocol, int ceiling) : name_(name) {
  pthread_mutexattr_t attributes;
  check(pthread_mutexattr_init(&attributes), name);
  int error = pthread_mutexattr_setprotocol(&attributes, protocol);
  if (error == 0 && protocol == PTHREAD_PRIO_PROTECT) error = pthread_mutexattr_setprioceiling(&attributes, ceiling);
  // A thread that locks it twice gets an error, and does not wait for itself.
  if (error == 0) error = pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ERRORCHECK);
  if (error == 0) error = pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
  check(error, name);
}

Lock::~Lock() { pthread_mutex_destroy(&mutex_); }

void Lock::lock() {
  if (try_lock()) return;
  Context* const context = present_context();
  const bool is_observed = context != nullptr && !timeline().is_virtual();
  const std::int64_t waits_before = is_observed ? voluntary_waits() : 0;
  const Nanoseconds began = is_observed ? now() : 0, cpu_before = is_observed ? cpu_time() : 0;
  check(pthread_mutex_lock(&mutex_), name_);
  if (is_observed) {
    // This wait is none of the codel's own.
    context->blocked += now() - began - (cpu_time() - cpu_before);
    context->lock_waits += voluntary_waits() - waits_before;
  }
  locked();
}

bool Lock::try_lock() {
  const int error = pthread_mutex_trylock(&mutex_);
  if (error == EBUSY) return false;
  check(error, name_);
  locked();
  return true;
}

void Lock::locked() {
  Context* const context = present_context();
  holder_ = context != nullptr && context->trace != nullptr ? context : nullptr;
  if (holder_ == nullptr) return;
  began_ = now();
  cpu_before_ = cpu_time();
}

void Lock::unlock() {
  Context* const holder = holder_;
  if (holder == nullptr) {
    check(pthread_mutex_unlock(&mutex_), name_);
    return;
  }
  const char* const codel = holder->codel.load(std::memory_order_relaxed);
  TraceRecord record =
      TraceRecord::of(TraceRecord::Lock, holder->instance.c_str(), name_, cpu_time() - cpu_before_, began_, now());
  record.program = codel == nullptr ? "-" : codel;
  holder_ = nullptr;
  check(pthread_mutex_unlock(&mutex_), name_);
  holder->trace->push(record);
}

}  // namespace mauve
