// locusd: reads its options and serves until SIGTERM or SIGINT, then drains and ends. `locusd check` and `locusd
// repair` verify or repair a data directory instead.

#include <poll.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/limits.h"
#include "core/base/mutex.h"
#include "core/base/progress_writer.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "server/config/server_config.h"
#include "server/config/version.h"
#include "server/observability/log.h"
#include "server/rpc/library_logs.h"
#include "server/scheduling/allocator_use.h"
#include "server/scheduling/semaphore.h"
#include "server/services/cluster/cluster_storage.h"
#include "server/services/server.h"
#include "server/storage/integrity/check.h"
#include "server/storage/integrity/repair.h"
#include "server/storage/rocksdb_log.h"

namespace locus::server {
namespace {

// Exit code after a second SIGTERM or SIGINT.
constexpr int kEndedAtOnce = 130;

// Raises the limit on open files as far as the system permits, because each connection is a file.
void allow_many_files() {
  rlimit limit;
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

int wait_for_signal(const sigset_t& signals) {
  int signal = 0;
  while (sigwait(&signals, &signal) != 0) {
  }
  return signal;
}

// Thread that waits for SIGTERM and SIGINT. It starts before the server, so that a signal can end the process even
// during a long start. The object is never destroyed. A second signal ends the process immediately.
class EndingSignals {
 public:
  static EndingSignals& listen() {
    static EndingSignals* const kSignals = new EndingSignals;
    return *kSignals;
  }

  // Returns a flag that becomes true when the first signal arrives.
  const std::atomic<bool>& received() const { return received_; }
  // Sets the function that the thread calls after each SIGHUP. If it is null, SIGHUP has no effect.
  void on_hangup(std::function<void()> reload) {
    const MutexLock lock(mutex_);
    reload_ = std::move(reload);
  }
  // Waits for the first signal and returns its number.
  int wait() {
    first_.wait();
    return signal_;
  }

 private:
  // Blocks the signals in the calling thread and starts the waiting thread. Must be called before any other thread
  // starts, so that all threads inherit the signal mask and only the waiting thread receives the signals.
  EndingSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::thread([this] {
      signal_ = wait_for_ending();
      received_.store(true);
      first_.post();
      wait_for_ending();
      std::_Exit(kEndedAtOnce);
    }).detach();
  }

  // Waits for SIGTERM or SIGINT and returns its number.
  int wait_for_ending() {
    for (int signal = wait_for_signal(signals_);; signal = wait_for_signal(signals_)) {
      if (signal != SIGHUP) return signal;
      const MutexLock lock(mutex_);
      if (reload_ != nullptr) reload_();
    }
  }

  sigset_t signals_;
  Mutex mutex_;
  std::function<void()> reload_ LOCUS_GUARDED_BY(mutex_);
  int signal_ = 0;
  std::atomic<bool> received_{false};
  Semaphore first_;
};

// Starts a thread that sends SIGTERM to this process when `parent`, the process that started it, has ended. Returns an
// error if `parent` is not the parent process, as when it has already ended. Call it after EndingSignals::listen().
absl::Status end_with(pid_t parent, const EndingSignals& signals) {
  const auto watched = static_cast<int>(syscall(SYS_pidfd_open, parent, 0));
  // While `parent` is the parent process, its number is not given to another process, so `watched` is the right
  // process.
  if (watched < 0 && errno != ESRCH && errno != EINVAL)
    return absl::FailedPreconditionError(
        absl::StrCat("--end-with-parent needs the system call pidfd_open: ", std::strerror(errno)));
  if (watched < 0 || getppid() != parent) {
    return absl::FailedPreconditionError(
        absl::StrCat("--end-with-parent: process ", parent, " is not the parent of this daemon, or it has ended"));
  }
  std::thread([watched, &signals] {
    pollfd end{.fd = watched, .events = POLLIN, .revents = 0};
    while (poll(&end, 1, /*timeout=*/-1) < 0 && errno == EINTR) {
    }
    if (!signals.received()) kill(getpid(), SIGTERM);  // a second signal would end the daemon without a drain
  }).detach();
  return absl::OkStatus();
}

// Writes the port to a temporary file and renames that file to `path`, so that a reader never reads a part of the
// number. Does nothing if `path` is empty. If writing fails, logs the error and returns false.
bool write_port_file(const std::string& path, uint16_t port) {
  if (path.empty()) return true;
  const std::string temporary = absl::StrCat(path, ".tmp");
  std::FILE* file = std::fopen(temporary.c_str(), "w");
  bool written = file != nullptr;
  if (written) {
    written = std::fprintf(file, "%u\n", static_cast<unsigned>(port)) > 0;
    written = std::fclose(file) == 0 && written;
    written = written && std::rename(temporary.c_str(), path.c_str()) == 0;
  }
  if (!written) log(LogLevel::kError, "cannot write the port file", {{"path", path}});
  return written;
}

std::string storage_of(const ServerConfig& config) {
  if (!config.cluster.empty()) return "the engine of a cluster";
  return config.data_dir.empty() ? "memory only: scenes are lost at exit" : config.data_dir;
}

void log_start(const Server& server, const ServerConfig& config) {
  log(LogLevel::kInfo, "serving",
      {{"addresses", absl::StrJoin(server.addresses(), ",")},
       {"http_port", absl::StrCat(server.http_port())},
       {"version", kVersion},
       {"threads", absl::StrCat(config.threads)},
       {"instruction_set", std::string(instruction_set())},
       {"memory_bytes", absl::StrCat(config.memory_limit)},
       {"receive_bytes", absl::StrCat(config.max_receive_bytes)},
       {"streams", absl::StrCat(config.max_streams)},
       {"storage", storage_of(config)}});
  if (config.insecure) log(LogLevel::kWarning, "insecure: connections are neither encrypted nor authenticated");
}

// Opens the log of the data directory; returns null if scenes are kept in memory only.
absl::StatusOr<std::unique_ptr<UpdateLog>> open_log(const ServerConfig& config) {
  if (config.data_dir.empty()) return nullptr;
  StorageOptions options;
  options.path = config.data_dir;
  options.warn = [](absl::string_view text) {
    log(LogLevel::kWarning, "warning of the storage library", {{"text", std::string(text)}});
  };
  return RocksdbLog::open(options);
}

int run(const ServerConfig& config) {
  start_logging(config.log_level, config.log_format);
  // While the server starts, log gRPC's errors at debug level only: Server::start() returns a clearer error.
  capture_library_logs(LogLevel::kDebug);
  if (const absl::Status chosen = use_instruction_set(config.instruction_set); !chosen.ok()) {
    log(LogLevel::kError, chosen.message());
    return EXIT_FAILURE;
  }
  EndingSignals& signals = EndingSignals::listen();
  if (config.end_with_parent != 0) {
    if (const absl::Status ends = end_with(static_cast<pid_t>(config.end_with_parent), signals); !ends.ok()) {
      log(LogLevel::kError, ends.message());
      return EXIT_FAILURE;
    }
  }
  // The logs are declared before the server, because the server writes to them until it is destroyed.
  absl::StatusOr<ClusterStorage> cluster = absl::NotFoundError("no cluster");
  if (!config.cluster.empty()) cluster = open_cluster(config);
  const absl::StatusOr<std::unique_ptr<UpdateLog>> update_log = open_log(config);
  const absl::Status opened = config.cluster.empty() ? update_log.status() : cluster.status();
  if (!opened.ok()) {
    log(LogLevel::kError, opened.message());
    return EXIT_FAILURE;
  }
  const absl::StatusOr<std::unique_ptr<Server>> server =
      Server::start(config, cluster.ok() ? cluster->log.get() : update_log->get(), signals.received(),
                    cluster.ok() ? &*cluster : nullptr);
  if (!server.ok()) {
    const bool stopped = signals.received().load() && absl::IsCancelled(server.status());
    log(stopped ? LogLevel::kInfo : LogLevel::kError, server.status().message());
    return stopped ? EXIT_SUCCESS : EXIT_FAILURE;
  }
  if (!write_port_file(config.http_port_file, (*server)->http_port()) ||
      !write_port_file(config.port_file, (*server)->port()))
    return EXIT_FAILURE;
  capture_library_logs(LogLevel::kWarning);
  log_start(**server, config);
  signals.on_hangup([&server = **server] { server.reload(); });
  const int signal = signals.wait();
  signals.on_hangup(nullptr);
  log(LogLevel::kInfo, "draining", {{"signal", strsignal(signal)}, {"grace_s", absl::StrCat(config.drain_grace_s)}});
  (*server)->drain(std::chrono::seconds(config.drain_grace_s));
  log(LogLevel::kInfo, "ended");
  return EXIT_SUCCESS;
}

template <class Report>
int print(const absl::StatusOr<Report>& report) {
  if (!report.ok()) {
    std::fprintf(stderr, "locusd: %s\n", std::string(report.status().message()).c_str());
    return EXIT_FAILURE;
  }
  std::fputs(to_text(*report).c_str(), stdout);
  return EXIT_SUCCESS;
}

// Returns a writer of progress on standard error.
ProgressWriter start_progress(ProgressChoice choice) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  winsize size{};
  const bool wide = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return ProgressWriter({.style = progress_style(choice, terminal),
                         .columns = wide ? size.ws_col : size_t{80},
                         .now = [] { return std::chrono::steady_clock::now(); },
                         .write = [](absl::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }});
}

// Runs `locusd check` or `locusd repair` and returns the exit code: 0 if `check` finds no damage, or if the directory
// can be used after `repair`.
int maintain(const Maintenance& maintenance) {
  StorageOptions options;
  options.path = maintenance.directory;
  ProgressWriter progress = start_progress(maintenance.progress);
  if (maintenance.task == Maintenance::Task::kRepair) {
    const absl::StatusOr<RepairReport> report = repair(options, &progress);
    progress.hide();
    return print(report);
  }
  const absl::StatusOr<DirectoryReport> report = check(options, &progress);
  progress.hide();
  const int printed = print(report);
  return printed == EXIT_SUCCESS && !report->intact() ? EXIT_FAILURE : printed;
}

}  // namespace
}  // namespace locus::server

int main(int argc, char** argv) {
  const locus::server::Invocation invocation =
      locus::server::read_invocation({argv + 1, argv + argc}, locus::server::process_environment);
  if (invocation.config) {
    locus::server::keep_freed_memory(invocation.config->memory_limit);
    locus::server::allow_many_files();
    return locus::server::run(*invocation.config);
  }
  if (invocation.maintenance) return locus::server::maintain(*invocation.maintenance);
  std::fputs(invocation.text.c_str(), invocation.exit_code == 0 ? stdout : stderr);
  return invocation.exit_code;
}
