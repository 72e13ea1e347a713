#include "trace_file.hpp"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace mauve {
namespace {

// The key of a codel or a program in a timing table.
std::string key_of(const TraceRecord& it) {
  if (it.kind == TraceRecord::Codel) return it.name;
  if (it.kind == TraceRecord::Access) return std::string("(access) ") + it.name;
  if (it.kind == TraceRecord::Lock) return std::string("(lock ") + it.name + ") " + it.program;
  const std::string component = std::string(it.name) + "/", state = it.state, transition = it.transition;
  if (state.empty()) return component + (transition.empty() ? it.program : transition.c_str());
  return component + state + (transition.empty() ? "" : "." + transition) + "." + it.program;
}

const char* text_of(Outcome outcome) {
  static const char* const texts[]{"", "no_data", "old_data", "new_data", "written", "lost", "unconnected", "false", "true"};
  return texts[static_cast<int>(outcome) + 1];
}

// A number, or an empty text where it is unknown.
std::string known(std::int64_t number) { return number < 0 ? "" : std::to_string(number); }

std::string quoted(const std::string& text) {
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
  return field + "\"";
}

std::string has_recording(const std::string& path) {
  return path + " is a recording, which is not overwritten: name another folder for --trace, or move or remove that one";
}

}  // namespace

const std::vector<TraceRecord>& TraceQueue::take() {
  taken_.clear();
  while (taken_.size() < taken_.capacity() &&
         records_.take([this](const TraceRecord& record) { taken_.push_back(record); })) {
  }
  // The threads' records arrive in about the order of time. Those of one thread keep their order: a period follows its programs.
  std::stable_sort(taken_.begin(), taken_.end(),
                   [](const TraceRecord& one, const TraceRecord& other) { return one.ended < other.ended; });
  return taken_;
}

TraceFile::TraceFile(const std::string& folder, const std::string& build, bool is_from_tables, std::string& problem) {
  if (mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) {
    problem = "the folder " + folder + " cannot be made: " + std::strerror(errno);
    return;
  }
  // The folder stays open, and neither it nor a file in it is a link: it may be another's, and lead to what is the user's.
  folder_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) {
    problem = "the folder " + folder + " cannot be opened: " + (errno == ENOTDIR ? "it is a link or a file" : std::strerror(errno));
    return;
  }
  shown_ = folder + "/";
  if (!begin(executions_, "executions.csv", "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns,status,number\n", problem) ||
      !begin(periods_, "periods.csv", "instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order,overhead_ns\n", problem)) {
    return;
  }
  // A recording took hours, and its robot may be elsewhere now. Another program that completes its files now had them when these
  // were begun.
  for (const File* const it : {&executions_, &periods_}) {
    struct stat status;
    if (fstatat(folder_, it->path.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0) {
      problem = has_recording(shown_ + it->path);
      return;
    }
  }
  if (is_from_tables && std::fputs("(from tables),0,,,,,,,,\n", executions_.file) < 0) error_ = errno;
  if (!build.empty() && std::fprintf(executions_.file, "%s,0,,,,,,,,\n", quoted("(build) " + build).c_str()) < 0) error_ = errno;
}

TraceFile::~TraceFile() {
  remove();
  if (folder_ >= 0) close(folder_);
}

bool TraceFile::begin(File& to, const std::string& path, const char* header, std::string& problem) {
  to.path = path;
  to.partial = path + ".partial";
  // Exclusively: what a power failure left, or another program records, stays.
  const int file = openat(folder_, to.partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  to.file = file < 0 ? nullptr : fdopen(file, "w");
  if (to.file == nullptr) {
    problem = errno == EEXIST ? is_taken(to.partial) : shown_ + to.partial + " cannot be written: " + std::strerror(errno);
    return false;
  }
  // It ends with this process, and says another one which process this is.
  struct flock lock = {};
  lock.l_type = F_WRLCK;
  fcntl(file, F_SETLK, &lock);
  if (std::fputs(header, to.file) < 0) error_ = errno;
  return true;
}

std::string TraceFile::is_taken(const std::string& partial) const {
  const int file = openat(folder_, partial.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  struct flock lock = {};
  lock.l_type = F_WRLCK;
  const bool is_held = file >= 0 && fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  if (file >= 0) close(file);
  if (!is_held) return has_recording(shown_ + partial);
  return "process " + std::to_string(lock.l_pid) + " records into " + shown_ + ": name another folder for --trace";
}

void TraceFile::write(const std::vector<TraceRecord>& records, std::uint64_t lost) {
  if (executions_.file == nullptr || periods_.file == nullptr || error_ != 0) return;
  for (const TraceRecord& it : records) {
    if (!write(it)) {
      error_ = errno;
      return;
    }
  }
  // Readers must not take what is lost for executions that did not happen.
  if (lost > lost_) {
    const Nanoseconds to = now(), from = records.empty() ? to : records.front().ended;
    const auto count = static_cast<unsigned long long>(lost - lost_), order = static_cast<unsigned long long>(order_++);
    if (std::fprintf(executions_.file, "(lost),%llu,,%lld,%lld,%llu,,,,\n", count, static_cast<long long>(std::max<Nanoseconds>(to - from, 0)),
                     static_cast<long long>(to), order) < 0) {
      error_ = errno;
    }
    lost_ = lost;
  }
  // Readers follow the recording.
  if (!records.empty() && (std::fflush(executions_.file) != 0 || std::fflush(periods_.file) != 0)) error_ = errno;
}

bool TraceFile::write(const TraceRecord& it) {
  const auto number = [](std::int64_t value) { return static_cast<long long>(value); };
  const auto order = static_cast<unsigned long long>(order_++);
  if (it.kind == TraceRecord::Period) {
    return std::fprintf(periods_.file, "%s,%s,%lld,%lld,%lld,%s,%s,%s,%llu,%s\n", it.instance, known(it.release).c_str(),
                        number(it.ended - it.elapsed), number(it.ended), number(it.execution), known(it.priority).c_str(),
                        known(it.cpus).c_str(), known(it.cpu).c_str(), order, known(it.overhead).c_str()) >= 0;
  }
  return std::fprintf(executions_.file, "%s,%lld,%s,%lld,%lld,%llu,%s,%s,%s,%s\n", key_of(it).c_str(), number(it.execution), it.instance,
                      number(it.elapsed), number(it.ended), order, known(it.waits).c_str(),
                      it.blocked > 0 ? known(it.blocked).c_str() : "", text_of(it.outcome),
                      it.number > 0 ? std::to_string(it.number).c_str() : "") >= 0;
}

void TraceFile::work(const std::string& name, Nanoseconds cpu, Nanoseconds elapsed) {
  if (executions_.file == nullptr || error_ != 0) return;
  // A thread may have any name.
  if (std::fprintf(executions_.file, "%s,%lld,,%lld,%lld,%llu,,,,\n", quoted("(work) " + name).c_str(), static_cast<long long>(cpu),
                   static_cast<long long>(elapsed), static_cast<long long>(now()), static_cast<unsigned long long>(order_++)) < 0) {
    error_ = errno;
  }
}

std::string TraceFile::put(const std::string& name, const std::string& text) {
  const int file = openat(folder_, name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  std::FILE* const to = file < 0 ? nullptr : fdopen(file, "w");
  bool is_written = to != nullptr && std::fwrite(text.data(), 1, text.size(), to) == text.size();
  if (to != nullptr && std::fclose(to) != 0) is_written = false;
  return is_written ? "" : shown_ + name + " cannot be written: " + std::strerror(errno);
}

std::string TraceFile::finish() {
  if (executions_.file == nullptr || periods_.file == nullptr) return "";
  for (File* const it : {&periods_, &executions_}) {
    if (error_ == 0 && std::fflush(it->file) != 0) error_ = errno;
    if (std::fclose(it->file) != 0 && error_ == 0) error_ = errno;
    it->file = nullptr;
  }
  // Without executions.csv, the folder is no recording: it gets its name last.
  for (File* const it : {&periods_, &executions_}) {
    if (error_ == 0 && renameat(folder_, it->partial.c_str(), folder_, it->path.c_str()) != 0) error_ = errno;
  }
  if (error_ != 0) {
    const std::string path = shown_ + executions_.path;
    return path + " could not be written: " + std::strerror(error_) + "; what was written is in " + path + ".partial";
  }
  return lost_ == 0 ? "" : shown_ + executions_.path + " lacks " + std::to_string(lost_) + " executions: too many at once";
}

void TraceFile::remove() {
  for (File* const it : {&executions_, &periods_}) {
    if (it->file == nullptr) continue;
    std::fclose(it->file);
    it->file = nullptr;
    // What was recorded before an error stays.
    if (order_ == 0) unlinkat(folder_, it->partial.c_str(), 0);
  }
}

}  // namespace mauve
