#include "trace_file.hpp"

#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace mauve {

TraceFile::TraceFile(const std::string& folder, std::string& problem)
    : path_(folder + "/executions.csv"), partial_(path_ + ".partial") {
  if (mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) {
    problem = "the folder " + folder + " cannot be made: " + std::strerror(errno);
    return;
  }
  file_ = std::fopen(partial_.c_str(), "we");
  if (file_ == nullptr) {
    problem = partial_ + " cannot be written: " + std::strerror(errno);
    return;
  }
  taken_.reserve(1 << 16);
  if (std::fputs("codel,execution_ns,instance,elapsed_ns,time_ns\n", file_) < 0) error_ = errno;
}

TraceFile::~TraceFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  unlink(partial_.c_str());
}

void TraceFile::write() {
  if (file_ == nullptr) return;
  taken_.clear();
  while (taken_.size() < taken_.capacity() &&
         queue_.records_.take([this](const TraceRecord& record) { taken_.push_back(record); })) {
  }
  if (error_ != 0) return;
  // The threads' records arrive in about the order of time.
  std::stable_sort(taken_.begin(), taken_.end(),
                   [](const TraceRecord& one, const TraceRecord& other) { return one.ended < other.ended; });
  for (const TraceRecord& it : taken_) {
    const int written = std::fprintf(file_, "%s,%lld,%s,%lld,%lld\n", it.codel, static_cast<long long>(it.execution),
                                     it.instance, static_cast<long long>(it.elapsed),
                                     static_cast<long long>(it.ended));
    if (written < 0) {
      error_ = errno;
      return;
    }
  }
}

std::string TraceFile::finish() {
  if (file_ == nullptr) return "";
  do {
    write();
  } while (!taken_.empty());
  if (error_ == 0 && std::fflush(file_) != 0) error_ = errno;
  if (std::fclose(file_) != 0 && error_ == 0) error_ = errno;
  file_ = nullptr;
  if (error_ == 0 && std::rename(partial_.c_str(), path_.c_str()) != 0) error_ = errno;
  if (error_ != 0) {
    unlink(partial_.c_str());
    return path_ + " could not be written: " + std::strerror(error_);
  }
  const std::uint64_t lost = queue_.records_.lost();
  return lost == 0 ? "" : path_ + " lacks " + std::to_string(lost) + " executions: too many at once";
}

}  // namespace mauve
