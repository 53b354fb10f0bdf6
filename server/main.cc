// locusd: reads its options, serves, and on SIGTERM or SIGINT drains and ends.

#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/limits.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "server/config/server_config.h"
#include "server/config/version.h"
#include "server/observability/log.h"
#include "server/rpc/library_logs.h"
#include "server/scheduling/semaphore.h"
#include "server/services/server.h"
#include "server/storage/integrity/report_text.h"
#include "server/storage/rocksdb_log.h"

namespace locus::server {
namespace {

constexpr int kEndedAtOnce = 130;

// Messages of megabytes come and go all the time. By default glibc gives their memory back to the kernel each time,
// which halves throughput. Where memory is short, less is kept.
void keep_freed_memory(uint64_t memory_limit) {
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, static_cast<int>(std::min(uint64_t{512} << 20, memory_limit / 8)));
  mallopt(M_TOP_PAD, 16 << 20);
}

// A connection is a file: as many as the system lets this process have.
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

// Hears of signals from before the server starts, which may take a while, and for good: never destroyed.
class EndingSignals {
 public:
  static EndingSignals& hear() {
    static EndingSignals* const signals = new EndingSignals;
    return *signals;
  }

  const std::atomic<bool>& came() const { return came_; }
  // The first one.
  int wait() {
    first_.wait();
    return signal_;
  }

 private:
  // Before any other thread starts, so that all of them leave these signals to this one.
  EndingSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::thread([this] {
      signal_ = wait_for_signal(signals_);
      came_.store(true);
      first_.post();
      wait_for_signal(signals_);
      std::_Exit(kEndedAtOnce);
    }).detach();
  }

  sigset_t signals_;
  int signal_ = 0;
  std::atomic<bool> came_{false};
  Semaphore first_;
};

// Whole or not at all: a reader never sees half a number. Nothing where there is no path; says itself why it failed.
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
       {"storage", config.data_dir.empty() ? "memory only: scenes are lost at exit" : config.data_dir}});
  if (config.insecure) log(LogLevel::kWarning, "insecure: nothing is encrypted and nobody is asked who they are");
}

// Null where scenes are kept in memory only.
absl::StatusOr<std::unique_ptr<UpdateLog>> open_log(const ServerConfig& config) {
  if (config.data_dir.empty()) return nullptr;
  StorageOptions options;
  options.path = config.data_dir;
  return RocksdbLog::open(options);
}

int run(const ServerConfig& config) {
  start_logging(config.log_level, config.log_format);
  // A server that does not start says why itself; what gRPC has to say of it helps nobody.
  capture_library_logs(LogLevel::kDebug);
  if (const absl::Status chosen = use_instruction_set(config.instruction_set); !chosen.ok()) {
    log(LogLevel::kError, chosen.message());
    return EXIT_FAILURE;
  }
  EndingSignals& signals = EndingSignals::hear();
  // Outlives the server, which writes to it to its last moment.
  const absl::StatusOr<std::unique_ptr<UpdateLog>> kept = open_log(config);
  if (!kept.ok()) {
    log(LogLevel::kError, kept.status().message());
    return EXIT_FAILURE;
  }
  const absl::StatusOr<std::unique_ptr<Server>> server = Server::start(config, kept->get(), signals.came());
  if (!server.ok()) {
    const bool told = signals.came().load() && absl::IsCancelled(server.status());
    log(told ? LogLevel::kInfo : LogLevel::kError, server.status().message());
    return told ? EXIT_SUCCESS : EXIT_FAILURE;
  }
  if (!write_port_file(config.http_port_file, (*server)->http_port()) ||
      !write_port_file(config.port_file, (*server)->port()))
    return EXIT_FAILURE;
  capture_library_logs(LogLevel::kWarning);
  log_start(**server, config);
  const int signal = signals.wait();
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

// check: 0 where all is sound. repair: 0 where the directory can be used afterwards.
int maintain(const Maintenance& maintenance) {
  StorageOptions options;
  options.path = maintenance.directory;
  if (maintenance.task == Maintenance::Task::kRepair) return print(repair(options));
  const absl::StatusOr<DirectoryReport> report = check(options);
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
