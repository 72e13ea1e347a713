// Loaded before all other libraries, it counts what threads of components must not do: allocate, and lock. It looks at the threads
// whose name is not that of the program, and prints what it has seen when the program ends. It begins and ends when the program says
// so, or at MAUVE_INTERPOSE_FROM and MAUVE_INTERPOSE_TO, in seconds after the start of the program. With MAUVE_INTERPOSE_THREADS, it looks
// at the threads with these names only.

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

double now() {
  timespec time = {};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Interposer {
  std::atomic<bool> is_ready{false};
  double begin = 0, end = 1e18;
  char program[16] = {};
  const char* threads = std::getenv("MAUVE_INTERPOSE_THREADS");
  std::atomic<unsigned long> allocations{0}, locks{0};
  std::atomic<const void*> first{nullptr};

  Interposer() {
    const char* const from = std::getenv("MAUVE_INTERPOSE_FROM");
    const char* const to = std::getenv("MAUVE_INTERPOSE_TO");
    prctl(PR_GET_NAME, program);
    if (from == nullptr || to == nullptr) return;
    begin = now() + std::atof(from);
    end = now() + std::atof(to);
    is_ready = true;
  }

  ~Interposer() {
    is_ready = false;
    Dl_info info = {};
    const void* const at = first.load();
    const bool is_known = at != nullptr && dladdr(at, &info) != 0;
    char text[512];
    const int length = std::snprintf(
        text, sizeof text, "interposer: %lu allocations, %lu locks, first in %s at 0x%zx (%s)\n", allocations.load(), locks.load(),
        is_known ? info.dli_fname : "nothing",
        is_known ? static_cast<std::size_t>(static_cast<const char*>(at) - static_cast<const char*>(info.dli_fbase)) : 0,
        is_known && info.dli_sname != nullptr ? info.dli_sname : "");
    if (write(STDERR_FILENO, text, static_cast<std::size_t>(length)) < 0) _exit(3);
  }

  bool counts() {
    if (!is_ready) return false;
    const double instant = now();
    if (instant < begin || instant > end) return false;
    char name[16] = {};
    prctl(PR_GET_NAME, name);
    return std::strcmp(name, program) != 0 && (threads == nullptr || std::strstr(threads, name) != nullptr);
  }

  void count(std::atomic<unsigned long>& what, const void* caller) {
    if (!counts()) return;
    ++what;
    const void* nothing = nullptr;
    first.compare_exchange_strong(nothing, caller);
  }
};

Interposer interposer;

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" void interposer_counts(bool counts) { interposer.is_ready = counts; }

#define CALLER __builtin_return_address(0)

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  interposer.count(interposer.allocations, CALLER);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  interposer.count(interposer.allocations, CALLER);
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  interposer.count(interposer.allocations, CALLER);
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  interposer.count(interposer.allocations, CALLER);
  return __libc_memalign(alignment, size);
}
void free(void* memory) {
  if (memory != nullptr) interposer.count(interposer.allocations, CALLER);
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  interposer.count(interposer.locks, CALLER);
  static auto* const real = next<int(pthread_mutex_t*)>("pthread_mutex_lock");
  return real(mutex);
}
int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  interposer.count(interposer.locks, CALLER);
  static auto* const real = next<int(pthread_cond_t*, pthread_mutex_t*)>("pthread_cond_wait");
  return real(condition, mutex);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) {
  interposer.count(interposer.locks, CALLER);
  static auto* const real = next<int(pthread_rwlock_t*)>("pthread_rwlock_rdlock");
  return real(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) {
  interposer.count(interposer.locks, CALLER);
  static auto* const real = next<int(pthread_rwlock_t*)>("pthread_rwlock_wrlock");
  return real(lock);
}
int sem_wait(sem_t* semaphore) {
  interposer.count(interposer.locks, CALLER);
  static auto* const real = next<int(sem_t*)>("sem_wait");
  return real(semaphore);
}

}  // extern "C"
