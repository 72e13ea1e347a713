// Runs codels alone: see mauve/measure.hpp.

#include "mauve/measure.hpp"

#include <malloc.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "context.hpp"
#include "mauve/clock.hpp"
#include "trace_file.hpp"

namespace mauve {
namespace {

// `mauve measure` and the readers of samples know these names, which no instance has.
const char warm_name[] = "(alone warm)";
const char cold_name[] = "(alone cold)";

constexpr std::size_t line = 64;
constexpr std::size_t least_memory = 4 << 20, most_memory = 32 << 20;

// A codel that does not return for so many seconds is named; and a codel that takes so many.
constexpr int patience = 5, long_time = 10;

// The codel that is measured, and how often codels were called: for the thread that watches them.
std::atomic<const char*> present_codel{nullptr};
std::atomic<std::uint64_t> calls{0};

// Names a codel that does not return. Nothing ends it but the user: its inputs may be hard ones.
void watch_calls() {
  std::uint64_t before = 0;
  for (int seconds = 0;; ++seconds) {
    sleep(1);
    const char* const codel = present_codel;
    if (calls != before || codel == nullptr) seconds = 0;
    before = calls;
    if (seconds == patience) {
      std::cerr << codel << " has not returned for " << patience
                << " s: it waits for something, or does not end; Ctrl-C ends the measurement" << std::endl;
    }
  }
}

// Twice the greatest cache, as far as that is reasonable.
std::size_t memory_to_fill() {
  const long known = std::max(sysconf(_SC_LEVEL2_CACHE_SIZE), sysconf(_SC_LEVEL3_CACHE_SIZE));
  return std::min(std::max(2 * static_cast<std::size_t>(std::max(known, 0L)), least_memory), most_memory);
}

// The last one of those that this process may use: the first ones serve most interrupts. -1 where it cannot be pinned.
int pin() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return -1;
  int cpu = CPU_SETSIZE - 1;
  while (cpu >= 0 && !CPU_ISSET(cpu, &set)) --cpu;
  if (cpu < 0) return -1;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  return sched_setaffinity(0, sizeof set, &set) == 0 ? cpu : -1;
}

}  // namespace

class Measurement::State {
 public:
  State(const std::string& folder, std::size_t count, const std::string& build, std::string& problem)
      : count_(count), memory_(memory_to_fill()), file_(new TraceFile(folder, build, false, problem)) {
    warm_.instance = warm_name;
    cold_.instance = cold_name;
    warm_.trace = cold_.trace = &queue_;
  }

  void run(const char* codel, std::size_t rows, const std::function<void(std::size_t)>& call) {
    // The last name is that of a codel that ends the program.
    std::cerr << "measuring " << codel << std::endl;
    present_codel = codel;
    const Nanoseconds began = now();
    const std::size_t colds = std::min(count_, std::max<std::size_t>(200, count_ / 100));
    const std::size_t blocks = std::min<std::size_t>(std::max<std::size_t>(count_ / 1000, 2), 100);
    for (std::size_t block = 0; block < blocks; ++block) {
      execute(nullptr, rows, 0, 20, call);
      execute(&warm_, rows, count_ * block / blocks, count_ * (block + 1) / blocks, call);
      execute(&cold_, rows, colds * block / blocks, colds * (block + 1) / blocks, call);
      const Nanoseconds seconds = (now() - began) * static_cast<Nanoseconds>(blocks) / 1000000000;
      if (block == 0 && seconds > long_time) {
        std::cerr << codel << " takes about " << seconds << " s; a smaller number -n takes less" << std::endl;
      }
    }
    present_codel = nullptr;
  }

  void prepare() {
    if (present_context() != &cold_) return;
    for (std::size_t at = 0; at < memory_.size(); at += line) ++memory_[at];
  }

  std::size_t memory() const { return memory_.size(); }

  std::string finish() {
    drain();
    return file_->finish();
  }

 private:
  void execute(Context* context, std::size_t rows, std::size_t from, std::size_t to, const std::function<void(std::size_t)>& call) {
    for (std::size_t at = from; at < to; ++at) {
      ++calls;
      set_present_context(context);
      call(at % rows);
      set_present_context(nullptr);
      if (at % 1000 == 999) drain();
    }
    drain();
  }

  void drain() { file_->write(queue_.take(), queue_.lost()); }

  const std::size_t count_;
  std::vector<unsigned char> memory_;
  TraceQueue queue_;
  Context warm_, cold_;
  std::unique_ptr<TraceFile> file_;
};

void Measurement::run(const char* codel, std::size_t rows, const std::function<void(std::size_t)>& call) {
  try {
    state_.run(codel, rows, call);
  } catch (const std::exception& error) {
    set_present_context(nullptr);
    throw std::runtime_error(std::string(codel) + " has thrown an exception: " + error.what());
  }
}

void Measurement::prepare() { state_.prepare(); }

int measure(int argc, char** argv, void (*codels)(Measurement&), const std::string& build) {
  const unsigned long long count = argc == 3 ? std::strtoull(argv[2], nullptr, 10) : 0;
  if (count == 0) {
    std::cerr << "error: this program takes the folder of the recording and the number of executions" << std::endl;
    return 2;
  }
  // Without `mauve measure`, nobody reads what is measured.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::thread(watch_calls).detach();
  // As in a robot: memory that is freed stays, and is used again.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  const int cpu = pin();
  std::string problem;
  Measurement::State state(argv[1], count, build, problem);
  if (problem.empty()) {
    std::cerr << (cpu < 0 ? "on any CPU: this process may not choose one" : "on CPU " + std::to_string(cpu))
              << "; before each execution with cold caches, " << (state.memory() >> 20) << " MB of other memory are written" << std::endl;
    Measurement measurement(state);
    try {
      codels(measurement);
      problem = state.finish();
    } catch (const std::exception& error) {
      problem = error.what();
    }
  }
  if (problem.empty()) return 0;
  std::cerr << "error: " << problem << std::endl;
  return 2;
}

}  // namespace mauve
