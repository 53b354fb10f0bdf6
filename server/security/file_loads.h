// Counts how often a set of files was read again because the files changed, and stores whether the newest files are in
// use. There is one object for the files of TLS and one for the files of access control. The page /metrics shows the
// values of both objects.
//
// Threads: every member may be called from any thread.
#ifndef LOCUS_SERVER_SECURITY_FILE_LOADS_H_
#define LOCUS_SERVER_SECURITY_FILE_LOADS_H_

#include <atomic>
#include <cstdint>

#include "absl/status/status.h"

namespace locus::server {

class FileLoads {
 public:
  // Records the first reading of the files, at the server's start. `unix_s` is the time in seconds since 1970.
  void start(int64_t unix_s) { loaded_s_.store(unix_s); }

  // Records that changed files were read. If `status` is OK, the changed files are in use since `unix_s`; otherwise the
  // previous files stay in use.
  void record(const absl::Status& status, int64_t unix_s) {
    (status.ok() ? reloads_ : failures_).fetch_add(1);
    if (status.ok()) loaded_s_.store(unix_s);
    refused_.store(!status.ok());
  }

  // Return how often changed files were put into use, and how often changed files could not be used.
  uint64_t reloads() const { return reloads_.load(); }
  uint64_t failures() const { return failures_.load(); }
  // Returns the time in seconds since 1970 at which the files in use were read; 0 if the server has no such files.
  int64_t loaded_s() const { return loaded_s_.load(); }
  // Returns whether the newest files could not be used, so that older ones are in use.
  bool refused() const { return refused_.load(); }

 private:
  std::atomic<uint64_t> reloads_{0};
  std::atomic<uint64_t> failures_{0};
  std::atomic<int64_t> loaded_s_{0};
  std::atomic<bool> refused_{false};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_FILE_LOADS_H_
