// Watches a few files by polling them with stat(). Polling also detects files that are replaced by renaming, and works
// on every file system. A change is reported when two successive polls find the same state, so that a file is not read
// while it is being written. A change that could not be handled is reported again until it is handled.
//
// Threads: one thread polls and calls the function; it ends in the destructor.
#ifndef LOCUS_SERVER_SECURITY_FILE_WATCHER_H_
#define LOCUS_SERVER_SECURITY_FILE_WATCHER_H_

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "server/security/security_limits.h"

namespace locus::server {

// State of a file as stat() reports it; all members are 0 if there is no such file or stat() fails.
struct FileMark {
  uint64_t device = 0;
  uint64_t inode = 0;
  uint64_t bytes = 0;
  int64_t modified_ns = 0;
  int64_t changed_ns = 0;

  bool operator==(const FileMark&) const = default;
};
// Returns the state of a file, following symbolic links.
FileMark mark_of(const std::string& file);

// Decides when a change must be reported. Starts no thread; one thread at a time may use it.
class FileChanges {
 public:
  using Mark = std::function<FileMark(const std::string& file)>;
  FileChanges(std::vector<std::string> files, Mark mark = mark_of);

  // Polls all files. Returns true if a change must be reported: the present state is equal to the state at the previous
  // poll, and differs from the state that was reported last. The present state then counts as reported.
  bool look();

 private:
  std::vector<FileMark> marks() const;

  const std::vector<std::string> files_;
  const Mark mark_;
  std::vector<FileMark> reported_;
  std::vector<FileMark> previous_;
};

class FileWatcher {
 public:
  // Calls `read` immediately, because the files may have changed since the caller read them. Then polls the files every
  // `pause` and calls `read` after each change. While `read` returns false, calls it again every `retry`, even without
  // a change.
  FileWatcher(std::vector<std::string> files, std::function<bool()> read,
              std::chrono::milliseconds pause = std::chrono::milliseconds(kFileWatchMilliseconds),
              std::chrono::milliseconds retry = std::chrono::milliseconds(kFileRetryMilliseconds));
  ~FileWatcher();
  FileWatcher(const FileWatcher&) = delete;
  FileWatcher& operator=(const FileWatcher&) = delete;

 private:
  bool wait() LOCUS_EXCLUDES(mutex_);
  void run() LOCUS_EXCLUDES(mutex_);

  const std::function<bool()> read_;
  const std::chrono::milliseconds pause_;
  const std::chrono::milliseconds retry_;
  FileChanges changes_;  // used by the thread only
  Mutex mutex_;
  ConditionVariable stop_;
  bool stopping_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_FILE_WATCHER_H_
