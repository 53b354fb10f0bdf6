// Programs that a benchmark starts, and their resources according to the kernel. Used by the benchmark suite `serving`.
// Only one thread uses an object. The kernel kills a program when the thread that started it ends, even if that thread
// is killed.
#ifndef LOCUS_TESTS_BENCH_SERVING_PROCESS_H_
#define LOCUS_TESTS_BENCH_SERVING_PROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace locus::bench::serving {

// Returns the processor time of all threads of a process, in nanosecond resolution; 0 if there is no such process.
double cpu_seconds_of(pid_t pid);

class Process {
 public:
  // Starts the program `path` with `arguments`, the first of which is the program's name; its output goes to the file
  // `log`. Returns UNAVAILABLE if there is no such program.
  static absl::StatusOr<std::unique_ptr<Process>> start(const std::string& path,
                                                        const std::vector<std::string>& arguments,
                                                        const std::string& log);
  // Sends SIGTERM to the process; kills it if it has not ended after five seconds.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  bool has_ended();
  // Returns the exit code of a process that has ended; -1 if a signal ended it.
  int exit_code() const { return exit_code_; }

  double cpu_seconds() const { return cpu_seconds_of(pid_); }
  int64_t resident_bytes() const;
  int64_t open_files() const;
  int64_t threads() const;

 private:
  explicit Process(pid_t pid) : pid_(pid) {}

  pid_t pid_;
  bool ended_ = false;
  int exit_code_ = -1;
};

// Return the path of the program `name` in the folder of this program, or in a folder of the PATH; empty if it is not
// there.
std::string program_beside(const std::string& name);
std::string program_in_path(const std::string& name);

// Returns the content of a file; empty if it cannot be read.
std::string text_of_file(const std::string& path);

void sleep_seconds(double seconds);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_PROCESS_H_
