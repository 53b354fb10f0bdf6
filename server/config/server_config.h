// Options of the daemon: each with its meaning, its default and when to change it. An option is set by a flag
// (--drain-grace-s 5), an environment variable (LOCUS_DRAIN_GRACE_S=5) or a line of the file that --config names
// (drain-grace-s = 5); the first of the three wins. Plain data, fixed once the daemon runs.
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
  // Addresses to listen on, one or more: `host:port`, `[v6]:port` or `unix:/path`; port 0 takes a free port. Change it
  // to serve other machines, which also needs `insecure`.
  std::vector<std::string> listen = {"127.0.0.1:7575"};

  // File to write the port of the first TCP address to, once the daemon answers. It is written atomically. Empty = not
  // written. For scripts that start the daemon on port 0.
  std::string port_file;

  // Address of the HTTP pages: /metrics for Prometheus, /healthz, /readyz. `host:port` or `[v6]:port`; port 0 takes a
  // free port; empty = no pages. If the default address is in use, the daemon logs a warning and runs without the
  // pages; any other address that is in use is an error. Change it to admit a scraper on another machine, which also
  // needs `insecure`: every reader of the pages learns the names of scenes and how they are used.
  std::string http_listen = kDefaultHttpListen;

  // File to write the HTTP port to, like `port_file`; empty = not written.
  std::string http_port_file;

  // Directory in which scenes and meshes are stored, so that they outlive the daemon. It is created if missing, and
  // used by one daemon at a time. Empty = memory only. Give it a disk of its own if there are many updates: every
  // acknowledged update waits for that disk.
  std::string data_dir;

  // Size in bytes of a scene's updates in the log after which a snapshot of the scene replaces them. For a scene larger
  // than this, the size of the scene is used instead. Lower it for a faster start and a smaller directory; raise it if
  // the updates leave the disk little bandwidth for snapshots.
  uint64_t snapshot_after = limits::kSnapshotAfterBytes;

  // Threads that may work on one query batch, the caller's own included; 0 = one for each core that this process may
  // use by its affinity and its control group. Answers do not depend on it. Lower it to leave cores to others.
  uint32_t threads = 0;

  // Priority of the threads that work on large query batches, relative to the threads that talk to clients and apply
  // updates: `nice` is 10 nice levels lower; `idle` runs only on cores that are otherwise idle. `idle` halves the wait
  // of small calls beside large ones, but starves if other processes use the whole machine.
  BatchPriority batch_priority = BatchPriority::kNice;

  // Vector instructions that queries use: a name that `locusd` logs at its start, or portable for none; empty = the
  // widest that the processor has. Answers do not depend on it. Change it to compare, or to rule out a fault of the
  // processor.
  std::string instruction_set;

  // Lowest level that is logged to standard error. `debug` adds a line for each refused call.
  LogLevel log_level = LogLevel::kInfo;

  // Format of log lines. `json` writes one object a line, for log collectors.
  LogFormat log_format = LogFormat::kText;

  // Milliseconds after which a query batch is logged as slow, measured from when its revision is available until its
  // answer. At most a few warnings a second; 0 = none. Lower it to find out what makes a server slow.
  uint32_t slow_query_ms = 1000;

  // Limits that may be lowered, never raised; a refusal names them. Lower them if memory is short or there are many
  // callers.
  uint32_t max_receive_bytes = limits::kReceiveBytes;  // one message
  uint32_t max_scenes = limits::kMaxScenes;
  uint32_t max_meshes = limits::kMaxMeshes;
  uint32_t max_streams = limits::kMaxStreams;  // open update and query streams
  uint32_t max_calls = limits::kMaxCalls;      // calls at once, not counting streams

  // Bytes of memory that the process may use before uploads, inserts and placements are refused; 0 = three quarters of
  // the memory of the machine or its control group. The rest is for messages, answers and moves, which are not refused.
  // Lower it to leave memory to other processes; above the default the kernel may kill the process.
  uint64_t memory_limit = 0;

  // Bytes of replaced data per scene that batches and dumps may keep alive by reading older revisions. Beyond that the
  // oldest readers are cancelled and updates wait for them. 0 = 256 MiB, or four times the size of the scene if that is
  // more. Lower it if memory is short; batches that run for several ticks are then cancelled sooner.
  uint64_t pinned_limit = 0;

  // Seconds that running calls may take to finish after SIGTERM. Raise it if batches run long; keep it below the time
  // after which the service manager kills the process.
  uint32_t drain_grace_s = 10;

  // Permits addresses that other machines can reach, although there is no encryption and no authentication. Use it only
  // behind a proxy or in a network where every machine is trusted.
  bool insecure = false;
};

// Function that returns the value of an environment variable, or nullopt if the variable is not set.
using Environment = std::function<std::optional<std::string>(const std::string&)>;

// Returns the value of a variable in the environment of this process. An Environment.
std::optional<std::string> process_environment(const std::string& name);

// Command that runs instead of the server: `locusd check` or `locusd repair`, for a data directory that no daemon is
// using, or `locusd config`.
struct Maintenance {
  enum class Task : uint8_t { kCheck, kRepair, kShowConfig };
  Task task = Task::kCheck;
  std::string directory;  // data directory, for check and repair
  bool json = false;      // whether to print JSON, for config
};

// Parsed command line: run with `config`, do `maintenance`, or, if neither is set, print `text` and end with
// `exit_code` (0 after --help, --version and the command config, 2 after a mistake, which `text` explains).
struct Invocation {
  std::optional<ServerConfig> config;
  std::optional<Maintenance> maintenance;
  int exit_code = 0;
  std::string text;
};

// Parses `arguments` (without the program's name), the environment and the file of --config. Never ends the process.
// The returned config is checked, and `threads` and `memory_limit` are not 0.
Invocation read_invocation(const std::vector<std::string>& arguments, const Environment& environment);

// Returns INVALID_ARGUMENT if an address cannot be parsed, or needs `insecure` because other machines can reach it.
absl::Status check_config(const ServerConfig& config);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_SERVER_CONFIG_H_
