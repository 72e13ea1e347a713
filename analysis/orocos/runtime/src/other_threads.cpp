#include "other_threads.hpp"

#include <dirent.h>
#include <time.h>

#include <cstdlib>
#include <fstream>

namespace mauve {
namespace {

// Less is the time between reading one clock and the next.
constexpr Nanoseconds least_rest = 1000000;

Nanoseconds cpu_of(clockid_t clock) {
  timespec used = {};
  if (clock_gettime(clock, &used) != 0) return -1;
  return used.tv_sec * Nanoseconds(1000000000) + used.tv_nsec;
}

// The clock of another thread's CPU time, as pthread_getcpuclockid makes it: that needs the thread's handle.
clockid_t clock_of(int thread) { return static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3) | 6u); }

std::vector<int> present_threads() {
  std::vector<int> found;
  DIR* const folder = opendir("/proc/self/task");
  if (folder == nullptr) return found;
  while (const dirent* const entry = readdir(folder)) {
    const int number = std::atoi(entry->d_name);
    if (number > 0) found.push_back(number);
  }
  closedir(folder);
  return found;
}

std::string name_of(int thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/comm");
  std::string name;
  std::getline(file, name);
  return name.empty() ? "(unnamed)" : name;
}

}  // namespace

void OtherThreads::ignore_present() {
  for (const int thread : present_threads()) own_.insert(thread);
}

void OtherThreads::begin(const std::set<int>& activities) {
  own_.insert(activities.begin(), activities.end());
  threads_.clear();
  look();
  for (auto& it : threads_) it.second.before = it.second.now;
  process_before_ = cpu_of(CLOCK_PROCESS_CPUTIME_ID);
}

void OtherThreads::look() {
  for (const int thread : present_threads()) {
    const Nanoseconds cpu = cpu_of(clock_of(thread));
    if (cpu < 0) continue;
    const auto found = threads_.find(thread);
    // The number of a thread that has ended may be that of another one later.
    if (found == threads_.end() || found->second.now > cpu) {
      threads_[thread] = {own_.count(thread) > 0 ? "" : name_of(thread), 0, cpu};
    } else {
      found->second.now = cpu;
    }
  }
}

Nanoseconds OtherThreads::sum() const {
  Nanoseconds sum = 0;
  for (const auto& it : threads_) sum += it.second.now - it.second.before;
  return sum;
}

std::vector<Work> OtherThreads::end() {
  look();
  std::map<std::string, Nanoseconds> by_name;
  for (const auto& it : threads_) {
    if (own_.count(it.first) == 0) by_name[it.second.name] += it.second.now - it.second.before;
  }
  // Threads that ended before anybody saw them, or after.
  const Nanoseconds rest = cpu_of(CLOCK_PROCESS_CPUTIME_ID) - process_before_ - sum();
  if (rest > least_rest) by_name["(ended)"] += rest;
  std::vector<Work> found;
  for (const auto& it : by_name) {
    if (it.second > 0) found.push_back({it.first, it.second});
  }
  return found;
}

}  // namespace mauve
