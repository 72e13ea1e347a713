#include "supervisor.hpp"

#include <pthread.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>

#include "timeline.hpp"

namespace mauve {
namespace {

sigset_t signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // As with `nohup`.
    struct sigaction present = {};
    if (sigaction(signal, nullptr, &present) == 0 && present.sa_handler != SIG_IGN) sigaddset(&set, signal);
  }
  return set;
}

}  // namespace

void block_signals() {
  const sigset_t set = signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // A reader of the output that has gone is no reason to end a robot in the middle of something.
  signal(SIGPIPE, SIG_IGN);
}

void unblock_signals() {
  const sigset_t set = signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

Supervisor::Supervisor(int priority, Nanoseconds grace, std::function<void()> on_end, std::function<std::string()> stuck)
    : on_end_(std::move(on_end)), stuck_(std::move(stuck)), thread_([=] { run(priority, grace); }) {}

Supervisor::~Supervisor() {
  is_finished_ = true;
  thread_.join();
}

void Supervisor::run(int priority, Nanoseconds grace) {
  sched_param parameter = {};
  parameter.sched_priority = priority;
  // Without the permission it supervises as well as it can.
  if (priority > 0) pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  const sigset_t set = signals();
  const timespec moment = {0, 20000000};
  Nanoseconds deadline = never;
  while (!is_finished_) {
    const bool is_signalled = sigtimedwait(&set, nullptr, &moment) > 0;
    const bool is_again = is_signalled && is_interrupted_;
    if (is_signalled) is_interrupted_ = true;
    if (!should_end_ && (is_signalled || real_now() >= end_)) {
      should_end_ = true;
      deadline = real_now() + grace;
      on_end_();
    }
    if (is_again || real_now() >= deadline) {
      const std::string text = "error: " + stuck_() + "\n";
      // All else may wait for what is stuck.
      if (write(STDERR_FILENO, text.data(), text.size()) < 0) _exit(1);
      _exit(1);
    }
  }
}

}  // namespace mauve
