#include "domain.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace mauve {
namespace {

// What is not greater is counted, if it is too large for its topic.
constexpr std::size_t least_sample_limit = 64 << 20;

// Ports of UDP end there.
constexpr int greatest_domain = 232;

// The numbers in a folder of /proc.
std::set<int> numbers_in(const char* path) {
  std::set<int> found;
  DIR* const folder = opendir(path);
  if (folder == nullptr) return found;
  while (const dirent* const entry = readdir(folder)) {
    if (entry->d_name[0] != '.') found.insert(std::atoi(entry->d_name));
  }
  closedir(folder);
  return found;
}

std::set<int> present_threads() { return numbers_in("/proc/self/task"); }

// The sockets that hear all interfaces.
std::set<int> open_sockets() {
  std::set<int> found;
  for (const int file : numbers_in("/proc/self/fd")) {
    sockaddr_in address = {};
    socklen_t size = sizeof address;
    const bool is_socket = getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) == 0;
    if (is_socket && address.sin_family == AF_INET && address.sin_addr.s_addr == htonl(INADDR_ANY)) found.insert(file);
  }
  return found;
}

cpu_set_t set_of(const Cpus& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (std::size_t cpu = 0; cpu < cpus.size(); ++cpu) {
    if (cpus[cpu]) CPU_SET(cpu, &set);
  }
  return set;
}

// What the user's configuration says, if it is a text or the first of its files can be read.
std::string own_configuration() {
  const char* const variable = std::getenv("CYCLONEDDS_URI");
  const std::string uri = variable == nullptr ? "" : variable;
  const std::string prefix = "file://";
  if (uri.empty() || uri[0] == '<') return uri;
  const std::string path = uri.compare(0, prefix.size(), prefix) == 0 ? uri.substr(prefix.size()) : uri;
  std::ifstream file(path.substr(0, path.find(',')));
  return std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

}  // namespace

int domain_number(int configured) {
  const char* const text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return configured;
  char* end = nullptr;
  const long number = std::strtol(text, &end, 10);
  if (*end != '\0' || number < 0 || number > greatest_domain) {
    throw std::runtime_error(std::string("ROS_DOMAIN_ID is `") + text + "`: set it to a number from 0 to " +
                             std::to_string(greatest_domain) + ", or unset it");
  }
  return static_cast<int>(number);
}

std::string configuration(Ros2::Discovery discovery, int priority, std::size_t unsent_bytes, std::size_t max_bytes) {
  const char* const variable = std::getenv("CYCLONEDDS_URI");
  const std::string more = variable == nullptr ? "" : variable;
  std::string out = "<CycloneDDS><Domain Id=\"any\">";
  if (discovery == Ros2::Localhost) {
    // As ROS 2 with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST, but only the loopback hears anything. It has no small packets.
    // An interface must not be there twice.
    const char* const loopback = "<Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>";
    out += std::string("<General>") + (has_own_interface() ? "" : loopback) +
           "<AllowMulticast>false</AllowMulticast>"
           "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>63000B</FragmentSize></General>"
           "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
           "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";
  }
  // A sample that is much too large is not even put together. A dead peer stops no other: only the last samples are kept for it, and
  // delay the end no longer than this.
  const std::size_t limit = std::max(least_sample_limit, 2 * max_bytes);
  out += "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads><WriterLingerDuration>100 ms</WriterLingerDuration>"
         "<MaxSampleSize>" + std::to_string(limit) + " B</MaxSampleSize>"
         "<Watermarks><WhcHigh>" + std::to_string(unsent_bytes) + " B</WhcHigh></Watermarks></Internal>";
  if (priority > 0) {
    out += "<Threads>";
    for (const char* const name : {"recv", "tev", "gc", "dq.builtins", "dq.user"}) {
      out += std::string("<Thread Name=\"") + name + "\"><Scheduling><Class>Realtime</Class><Priority>" + std::to_string(priority) +
             "</Priority></Scheduling></Thread>";
    }
    out += "</Threads>";
  }
  out += "</Domain></CycloneDDS>";
  return more.empty() ? out : out + "," + more;
}

bool has_own_interface() { return own_configuration().find("NetworkInterface") != std::string::npos; }

void on_loopback(const std::function<void()>& function) {
  const std::set<int> before = open_sockets();
  function();
  for (const int file : open_sockets()) {
    if (before.count(file) > 0 || setsockopt(file, SOL_SOCKET, SO_BINDTODEVICE, "lo", 3) == 0) continue;
    const std::string reason = std::strerror(errno);
    throw std::runtime_error("other computers could reach the robot: a socket cannot be bound to `lo` (" + reason +
                             "); use Linux 5.7 or later, run as root, or set discovery = \"subnet\" in [ros2]");
  }
}

bool may_have_priority(int priority) {
  int error = 0;
  std::thread probe([&] {
    sched_param parameter = {};
    parameter.sched_priority = priority;
    error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  });
  probe.join();
  return error == 0;
}

std::set<int> confined(const Cpus& cpus, const std::function<void()>& function) {
  const std::set<int> before = present_threads();
  std::exception_ptr thrown;
  std::thread starter([&] {
    const cpu_set_t wanted = set_of(cpus);
    // Where it fails, the threads are elsewhere, and `difference` says it.
    if (cpus.any()) pthread_setaffinity_np(pthread_self(), sizeof wanted, &wanted);
    try {
      function();
    } catch (...) {
      thrown = std::current_exception();
    }
  });
  starter.join();
  if (thrown) std::rethrow_exception(thrown);
  std::set<int> started;
  for (const int thread : present_threads()) {
    if (before.count(thread) == 0) started.insert(thread);
  }
  return started;
}

std::string name_of_thread(int number) {
  std::ifstream file("/proc/self/task/" + std::to_string(number) + "/comm");
  std::string name;
  std::getline(file, name);
  return name;
}

std::string difference(int thread, const MiddlewareScheduling& wanted) {
  sched_param parameter = {};
  const int scheduler = sched_getscheduler(thread);
  // It has ended.
  if (scheduler < 0 || sched_getparam(thread, &parameter) != 0) return "";
  if (wanted.priority > 0 && (scheduler != SCHED_FIFO || parameter.sched_priority != wanted.priority)) {
    const std::string has = "has priority " + std::to_string(parameter.sched_priority);
    return (scheduler == SCHED_FIFO ? has : "is not scheduled by SCHED_FIFO") + " instead of priority " + std::to_string(wanted.priority);
  }
  const cpu_set_t cpus = set_of(wanted.cpus);
  cpu_set_t present;
  CPU_ZERO(&present);
  if (wanted.cpus.any() && (sched_getaffinity(thread, sizeof present, &present) != 0 || !CPU_EQUAL(&present, &cpus))) {
    return "is not on the CPUs of the gateway alone";
  }
  return "";
}

Nanoseconds cpu_of(int thread) {
  timespec used = {};
  // As pthread_getcpuclockid makes it: that needs the thread's handle.
  clock_gettime(static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3) | 6u), &used);
  return used.tv_sec * Nanoseconds(1000000000) + used.tv_nsec;
}

void set_priority(int thread, int priority) {
  sched_param parameter = {};
  parameter.sched_priority = priority;
  sched_setscheduler(thread, priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameter);
}

struct Scheduled::Before {
  int scheduler;
  sched_param parameter;
  cpu_set_t cpus;
};

Scheduled::Scheduled(const MiddlewareScheduling& wanted) : before_(nullptr) {
  Before before = {};
  sched_param parameter = {};
  parameter.sched_priority = wanted.priority;
  if (wanted.priority == 0 || pthread_getschedparam(pthread_self(), &before.scheduler, &before.parameter) != 0 ||
      pthread_getaffinity_np(pthread_self(), sizeof before.cpus, &before.cpus) != 0) {
    return;
  }
  const cpu_set_t cpus = set_of(wanted.cpus);
  before_ = new Before(before);
  if (wanted.cpus.any()) pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
}

Scheduled::~Scheduled() {
  if (before_ == nullptr) return;
  pthread_setschedparam(pthread_self(), before_->scheduler, &before_->parameter);
  pthread_setaffinity_np(pthread_self(), sizeof before_->cpus, &before_->cpus);
  delete before_;
}

}  // namespace mauve
