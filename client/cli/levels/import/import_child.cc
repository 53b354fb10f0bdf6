#include "client/cli/levels/import/import_child.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/syscall_filter.h"
#include "core/base/sanitized_build.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAnswerDescriptor = 3;
constexpr char kFiltered = 'F';
constexpr char kUnfiltered = 'U';

// Exit codes of the child, chosen so that they differ from the usual exit codes of programs.
constexpr int kMemoryExit = 101;
constexpr int kSetupExit = 102;
constexpr int kThrownExit = 103;

constexpr absl::string_view kRemedy = "the file is damaged or made to do harm; export it again or convert it to GLB";

// Functions that run in the child. The child is forked from a process that may have other threads, so these functions
// use no lock that another thread could hold. malloc() is safe, because the C library resets its locks in the child.

bool set_limit(__rlimit_resource resource, uint64_t value) {
  const rlimit limit{value, value};
  return setrlimit(resource, &limit) == 0;
}

// Returns the address space that the process uses, in bytes; 0 if it is unknown.
uint64_t used_address_space() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  std::array<char, 64> text{};
  const ssize_t size = read(file, text.data(), text.size() - 1);
  close(file);
  unsigned long long pages = 0;
  if (size <= 0 || std::sscanf(text.data(), "%llu", &pages) != 1) return 0;
  return uint64_t{pages} * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

bool limit_resources(const ChildLimits& limits) {
  const uint64_t used = used_address_space();  // read now, because no file can be opened after the limits are set
  // The kernel sends SIGXCPU at the soft limit, and SIGKILL at the hard limit.
  const rlimit processor{limits.cpu_seconds, limits.cpu_seconds + 1};
  const bool limited = set_limit(RLIMIT_CORE, 0) && set_limit(RLIMIT_FSIZE, 0) && set_limit(RLIMIT_NOFILE, 0) &&
                       setrlimit(RLIMIT_CPU, &processor) == 0;
  if (kSanitizedBuild) return limited;
  return limited && used > 0 && set_limit(RLIMIT_AS, used + limits.memory_bytes) &&
         set_limit(RLIMIT_DATA, used + limits.memory_bytes);
}

// Restores the default action of the signals listed here, and unblocks all signals. The handlers of other signals stay,
// for example for SIGSEGV, because sanitizers report errors through them.
void reset_signals() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGXCPU, SIGXFSZ, SIGUSR1, SIGUSR2, SIGALRM})
    signal(number, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

// Moves the pipe to kAnswerDescriptor, and closes all other files except the standard streams.
bool keep_only(int pipe_end) {
  if (pipe_end != kAnswerDescriptor && dup2(pipe_end, kAnswerDescriptor) < 0) return false;
  if (close_range(kAnswerDescriptor + 1, ~0u, 0) == 0) return true;
  const long all = sysconf(_SC_OPEN_MAX);  // fallback for kernels before 5.9, which lack close_range()
  for (int file = kAnswerDescriptor + 1; file < all; ++file) close(file);
  return true;
}

void send(const char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t some = write(kAnswerDescriptor, bytes, size);
    if (some < 0 && errno == EINTR) continue;
    if (some <= 0) _exit(kSetupExit);
    bytes += some;
    size -= static_cast<size_t>(some);
  }
}

[[noreturn]] void run_child(pid_t parent, int pipe_end, const ChildLimits& limits,
                            absl::FunctionRef<std::string()> produce) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) _exit(kSetupExit);
  reset_signals();
  if (!keep_only(pipe_end) || !limit_resources(limits)) _exit(kSetupExit);
  std::set_new_handler([] { _exit(kMemoryExit); });
  const char state = load_syscall_filter(kAnswerDescriptor) ? kFiltered : kUnfiltered;
  send(&state, 1);
  try {
    const std::string bytes = produce();
    send(bytes.data(), bytes.size());
  } catch (...) {
    _exit(kThrownExit);
  }
  _exit(0);
}

// Functions and types of the parent.

// Child process. The destructor kills the process if it still runs, and then waits for its end (reaps it).
class Child {
 public:
  Child(pid_t pid, int pipe_end) : pid_(pid), pipe_end_(pipe_end) {}
  ~Child() {
    end();
    close(pipe_end_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Kills the child if it still runs, and returns its wait status. The signal has no effect on a child that has already
  // exited.
  int end() {
    if (pid_ <= 0) return status_;
    kill(pid_, SIGKILL);
    while (waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    return status_;
  }

  enum class Reading { kEnded, kTimeout, kTooLong, kFailed };
  // Appends the child's output to `bytes`. Stops when the child ends, a read fails, `bytes` would exceed `max_bytes`,
  // or the time `until` is reached.
  Reading read_all(uint64_t max_bytes, Clock::time_point until, std::string& bytes) {
    std::array<char, 1 << 16> chunk;
    while (true) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
      if (left <= 0) return Reading::kTimeout;
      pollfd ready{pipe_end_, POLLIN, 0};
      const int polled = poll(&ready, 1, static_cast<int>(std::min<int64_t>(left, 60'000)));
      if (polled < 0 && errno != EINTR) return Reading::kFailed;
      if (polled <= 0) continue;
      const ssize_t some = read(pipe_end_, chunk.data(), chunk.size());
      if (some < 0 && errno != EINTR) return Reading::kFailed;
      if (some == 0) return Reading::kEnded;
      if (some < 0) continue;
      if (static_cast<uint64_t>(some) > max_bytes - bytes.size()) return Reading::kTooLong;
      bytes.append(chunk.data(), static_cast<size_t>(some));
    }
  }

 private:
  pid_t pid_;
  int pipe_end_;
  int status_ = 0;
};

absl::Status memory_exceeded(absl::string_view what, uint64_t bytes) {
  return exceeds(absl::StrCat("reading ", what), "taken more memory", "import_memory", bytes,
                 "split it into several files");
}

absl::Status failure(absl::string_view doing, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("the importer ", doing, " while reading ", what, ": ", kRemedy));
}

// Converts a wait status to an error; OK if the child exited with code 0.
absl::Status error_of(int status, absl::string_view what, const ChildLimits& limits) {
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    if (number == SIGXCPU) {
      return exceeds(absl::StrCat("reading ", what), "taken more processor time", "import_cpu_seconds",
                     limits.cpu_seconds, "split it into several files");
    }
    if (number == SIGSYS) return failure(absl::StrCat("made a forbidden system call (signal ", number, ")"), what);
    return failure(absl::StrCat("crashed (signal ", number, ")"), what);
  }
  switch (WEXITSTATUS(status)) {
    case 0:
      return absl::OkStatus();
    case kMemoryExit:
      return memory_exceeded(what, limits.memory_bytes);
    case kThrownExit:
      return failure("threw an exception", what);
    case kSetupExit:
      return absl::ResourceExhaustedError(
          absl::StrCat("cannot limit the process that reads ", what, ": give it a pipe and /proc, and try again"));
    default:
      return failure(absl::StrCat("ended with code ", WEXITSTATUS(status)), what);
  }
}

absl::StatusOr<ChildAnswer> collect(Child& child, absl::string_view what, const ChildLimits& limits) {
  const Clock::time_point until = Clock::now() + std::chrono::seconds(limits.seconds);
  std::string bytes;
  const Child::Reading reading = child.read_all(limits.memory_bytes, until, bytes);
  const int status = child.end();
  switch (reading) {
    case Child::Reading::kTimeout:
      return exceeds(absl::StrCat("reading ", what), "taken longer", "import_seconds", limits.seconds,
                     "split it into several files");
    case Child::Reading::kTooLong:
      return memory_exceeded(what, limits.memory_bytes);
    case Child::Reading::kFailed:
      return failure("lost its pipe", what);
    case Child::Reading::kEnded:
      break;
  }
  RETURN_IF_ERROR(error_of(status, what, limits));
  if (bytes.empty()) return failure("gave no answer", what);
  const bool filtered = bytes.front() == kFiltered;
  bytes.erase(0, 1);
  return ChildAnswer{std::move(bytes), filtered};
}

}  // namespace

ChildLimits limits_for(uint64_t file_bytes) {
  ChildLimits limits;
  const uint64_t most = (kMaxImportMemory - kImportMemoryBase) / kImportMemoryFactor;
  limits.memory_bytes = kImportMemoryBase + kImportMemoryFactor * std::min(file_bytes, most);
  return limits;
}

absl::StatusOr<ChildAnswer> run_in_child(absl::string_view what, const ChildLimits& limits,
                                         absl::FunctionRef<std::string()> produce) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    return absl::ResourceExhaustedError(absl::StrCat("cannot read ", what, ": no pipe: ", strerror(errno)));
  }
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) run_child(parent, ends[1], limits, produce);
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    return absl::ResourceExhaustedError(absl::StrCat("cannot read ", what, ": no process: ", strerror(errno)));
  }
  Child child(pid, ends[0]);
  return collect(child, what, limits);
}

}  // namespace locus::cli
