// What an operator can choose: each option with its meaning, its default and when to change it. Three places set an
// option, the first that does wins: a flag (--drain-grace-s 5), an environment variable (LOCUS_DRAIN_GRACE_S=5), a line
// of the file that --config names (drain-grace-s = 5). Plain data, fixed once the daemon runs.
#ifndef LOCUS_SERVER_CONFIG_SERVER_CONFIG_H_
#define LOCUS_SERVER_CONFIG_SERVER_CONFIG_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/base/limits.h"

namespace locus::server {

enum class LogLevel : uint8_t { kDebug, kInfo, kWarning, kError };
enum class LogFormat : uint8_t { kText, kJson };
enum class BatchPriority : uint8_t { kNice, kIdle };

inline constexpr const char* kDefaultHttpListen = "127.0.0.1:7576";

struct ServerConfig {
  // Where to listen; more than one address is fine. `host:port`, `[v6]:port` or `unix:/path`; port 0 takes a free one.
  // Change it to serve other machines, which also needs `insecure`.
  std::vector<std::string> listen = {"127.0.0.1:7575"};

  // Written with the first TCP address's port once the daemon answers, whole or not at all; empty = not written. For
  // scripts that start the daemon on port 0.
  std::string port_file;

  // Where metrics and health pages are served by HTTP: /metrics for Prometheus, /healthz, /readyz. `host:port` or
  // `[v6]:port`; port 0 takes a free one; empty = nowhere. Where the default is taken, the daemon warns and goes on
  // without; any other address it must get. Change it to let a scraper on another machine in, which also needs
  // `insecure`: whoever reads the pages learns the names of scenes and how they are used.
  std::string http_listen = kDefaultHttpListen;

  // Written with the HTTP port as `port_file` is; empty = not written.
  std::string http_port_file;

  // The directory that scenes and meshes are kept in, so that they outlive the daemon: made where it is missing, used
  // by one daemon at a time. Empty = memory only. Give it a disk of its own where updates are many: every acknowledged
  // update waits for that disk.
  std::string data_dir;

  // Bytes of updates of a scene in the log after which a snapshot of the scene takes their place; for a scene that
  // takes more than that, as much as it takes. Lower it for a faster start and a smaller directory, raise it where the
  // disk has little to spare beside the updates.
  uint64_t snapshot_after = limits::kSnapshotAfterBytes;

  // Threads that may work on one query batch, the caller's own included; 0 = the cores this process may use, by its
  // affinity and its control group. Answers do not depend on it. Lower it to leave cores to others.
  uint32_t threads = 0;

  // How threads that work on large query batches stand beside those that talk to clients and apply updates: `nice` 10
  // steps below, or `idle`, which runs only when nobody else wants a core. Idle halves the wait of small calls beside
  // large ones, but starves where other processes fill the machine.
  BatchPriority batch_priority = BatchPriority::kNice;

  // The vector instructions that queries use: a name that `locusd` logs at its start, or portable for none; empty = the
  // widest that the processor has. Answers do not depend on it. Change it to compare, or to rule out a processor's
  // fault.
  std::string instruction_set;

  // What is logged to standard error. `debug` adds a line for each refused call.
  LogLevel log_level = LogLevel::kInfo;

  // `json` writes one object a line, for collectors.
  LogFormat log_format = LogFormat::kText;

  // A batch of queries that takes longer, in milliseconds from its turn to its answer, is logged as a warning, a few a
  // second at most; 0 = none. Lower it to find out what makes a server slow.
  uint32_t slow_query_ms = 1000;

  // Limits that may be lowered, never raised; a refusal names them. Lower them where memory is short or callers are
  // many.
  uint32_t max_receive_bytes = limits::kReceiveBytes;  // one message
  uint32_t max_scenes = limits::kMaxScenes;
  uint32_t max_meshes = limits::kMaxMeshes;
  uint32_t max_streams = limits::kMaxStreams;  // open update and query streams
  uint32_t max_calls = limits::kMaxCalls;      // calls in work at once, streams apart

  // Bytes of memory that the process may hold before uploads, inserts and placements are refused; 0 = three quarters of
  // what the machine or its control group has. The rest is for messages, answers and moves, which are not refused.
  // Lower it to leave memory to others; above the default the kernel may end the process.
  uint64_t memory_limit = 0;

  // Bytes of what updates replaced that batches and dumps may keep from being freed by reading older revisions of a
  // scene; beyond that the oldest are ended and updates wait. 0 = 256 MiB, or four times what the scene takes where
  // that is more. Lower it where memory is short; a batch that outlasts a few whole ticks is then refused sooner.
  uint64_t pinned_limit = 0;

  // Seconds that calls in work may take to finish after SIGTERM. Raise it where batches run long; keep it below what
  // the service manager waits before it kills.
  uint32_t drain_grace_s = 10;

  // True listens beyond this machine although nothing is encrypted and nobody is asked for a password. Only behind a
  // proxy or in a network where every machine is trusted.
  bool insecure = false;
};

// One environment variable; nothing where it is not set.
using Environment = std::function<std::optional<std::string>(const std::string&)>;

// Reads the process's own environment.
std::optional<std::string> process_environment(const std::string& name);

// Work on a data directory that no daemon uses meanwhile: `locusd check` and `locusd repair`.
struct Maintenance {
  enum class Task : uint8_t { kCheck, kRepair };
  Task task = Task::kCheck;
  std::string directory;
};

// What a command line asks for: to run with `config`, to do `maintenance`, or, without either, to print `text` and end
// with `exit_code` (0 after --help and --version, 2 after a mistake, which `text` explains).
struct Invocation {
  std::optional<ServerConfig> config;
  std::optional<Maintenance> maintenance;
  int exit_code = 0;
  std::string text;
};

// `arguments` without the program's name. Never ends the process. The config is checked; `threads` and
// `memory_limit` are filled in.
Invocation read_invocation(const std::vector<std::string>& arguments, const Environment& environment);

// INVALID_ARGUMENT where an address cannot be listened to, or should not be without `insecure`.
absl::Status check_config(const ServerConfig& config);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_SERVER_CONFIG_H_
