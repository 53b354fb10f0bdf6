#include "server/security/file_watcher.h"

#include <sys/stat.h>

#include <utility>

namespace locus::server {
namespace {

constexpr int64_t kNanoseconds = 1'000'000'000;

int64_t nanoseconds_of(const timespec& time) { return int64_t{time.tv_sec} * kNanoseconds + time.tv_nsec; }

}  // namespace

FileMark mark_of(const std::string& file) {
  struct stat status;
  if (::stat(file.c_str(), &status) != 0) return {};
  FileMark mark;
  mark.device = status.st_dev;
  mark.inode = status.st_ino;
  mark.bytes = static_cast<uint64_t>(status.st_size);
  mark.modified_ns = nanoseconds_of(status.st_mtim);
  mark.changed_ns = nanoseconds_of(status.st_ctim);
  return mark;
}

FileChanges::FileChanges(std::vector<std::string> files, Mark mark)
    : files_(std::move(files)), mark_(std::move(mark)), reported_(marks()), previous_(reported_) {}

bool FileChanges::look() {
  std::vector<FileMark> now = marks();
  const bool stable = now == previous_;
  previous_ = std::move(now);
  if (!stable || previous_ == reported_) return false;
  reported_ = previous_;
  return true;
}

std::vector<FileMark> FileChanges::marks() const {
  std::vector<FileMark> marks;
  marks.reserve(files_.size());
  for (const std::string& file : files_) marks.push_back(mark_(file));
  return marks;
}

FileWatcher::FileWatcher(std::vector<std::string> files, std::function<bool()> read, std::chrono::milliseconds pause,
                         std::chrono::milliseconds retry)
    : read_(std::move(read)), pause_(pause), retry_(retry), changes_(std::move(files)), thread_([this] { run(); }) {}

FileWatcher::~FileWatcher() {
  {
    MutexLock lock(mutex_);
    stopping_ = true;
    stop_.notify_all();
  }
  thread_.join();
}

// Waits for the pause. Returns false if the watcher must stop.
bool FileWatcher::wait() {
  const auto deadline = std::chrono::steady_clock::now() + pause_;
  MutexLock lock(mutex_);
  while (!stopping_)
    if (!stop_.wait_until(mutex_, deadline)) return !stopping_;
  return false;
}

void FileWatcher::run() {
  bool good = read_();
  auto last_read = std::chrono::steady_clock::now();
  while (wait()) {
    const auto now = std::chrono::steady_clock::now();
    const bool is_due = !good && now - last_read >= retry_;
    if (!changes_.look() && !is_due) continue;
    good = read_();
    last_read = now;
  }
}

}  // namespace locus::server
