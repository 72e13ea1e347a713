// The work of threads that are neither activities nor the runtime's own: a codel has started them.

#ifndef MAUVE_OTHER_THREADS_HPP
#define MAUVE_OTHER_THREADS_HPP

#include <map>
#include <set>
#include <string>
#include <vector>

#include "mauve/clock.hpp"

namespace mauve {

// The CPU time that a thread has used.
struct Work {
  std::string name;
  Nanoseconds cpu;
};

// Observes the threads of this process. All its functions are for one thread.
class OtherThreads {
 public:
  // All threads that are there now are the runtime's own.
  void ignore_present();
  // Begins: these are the threads of activities.
  void begin(const std::set<int>& activities);
  // To be called now and then: threads may end.
  void look();
  // Ends. Returns the CPU time since `begin`, by the name of the thread.
  std::vector<Work> end();

 private:
  struct Thread {
    std::string name;
    Nanoseconds before, now;
  };

  Nanoseconds sum() const;

  std::set<int> own_;
  // By the system's number; also those of activities and of the runtime.
  std::map<int, Thread> threads_;
  Nanoseconds process_before_ = 0;
};

}  // namespace mauve

#endif
