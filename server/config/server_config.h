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
#include "core/base/progress_line.h"

namespace locus::server {

enum class LogLevel : uint8_t { kDebug, kInfo, kWarning, kError };
enum class LogFormat : uint8_t { kText, kJson };
enum class BatchPriority : uint8_t { kNice, kIdle };

// Part of a cluster's engine that copies each change to a second machine before the engine acknowledges it.
enum class ReplicatedBy : uint8_t { kStandbys, kStorage };

inline constexpr const char* kDefaultHttpListen = "127.0.0.1:7576";

struct ServerConfig {
  // Addresses to listen on, one or more: `host:port`, `[v6]:port` or `unix:/path`; port 0 means any free port. Change
  // this option to serve other machines; that also needs `tls_cert` and `access_file`, or `insecure`.
  std::vector<std::string> listen = {"127.0.0.1:7575"};

  // Permissions of the files of unix sockets, in octal, and their owner: `user` or `user:group`, empty = the user of
  // the daemon. Change them to admit processes of other users, who need write permission to connect.
  std::string unix_mode = "0600";
  std::string unix_owner;

  // File to write the port of the first TCP address to, once the daemon answers; empty = no file. The file is written
  // atomically. Use it in scripts that start the daemon on port 0.
  std::string port_file;

  // Address of the HTTP pages: /metrics for Prometheus, /healthz, /readyz. `host:port` or `[v6]:port`; port 0 means any
  // free port; empty = no pages. If the default address is in use, the daemon logs a warning and runs without the
  // pages; any other address that is in use is an error. With `tls_cert`, the pages use TLS, like all other TCP
  // connections. With access control, a reader of /metrics needs the right `metrics`, because the page shows the names
  // and the use of scenes; /healthz and /readyz are for everybody. Change this option so that a scraper on another
  // machine can read the pages; that also needs `tls_cert` and `access_file`, or `insecure`.
  std::string http_listen = kDefaultHttpListen;

  // File to write the port of the HTTP pages to, once they are served; empty = no file.
  std::string http_port_file;

  // Directory in which scenes and meshes are stored, so that they outlive the daemon; empty = memory only. The
  // directory is created if it is missing, and only one daemon at a time can use it. If there are many updates, put the
  // directory on a disk of its own, because updates wait for that disk before they are acknowledged.
  std::string data_dir;

  // Engine of the cluster that the daemon joins: postgresql://[user@]host[:port],.../database, the hosts of a
  // replicated PostgreSQL, with settings of libpq such as ?passfile=/etc/locus/pgpass&sslmode=verify-full; empty = no
  // cluster. Scenes and meshes are then stored by the engine, so there is no `data_dir`. Passwords belong into the
  // password file.
  std::string cluster;

  // Address at which clients and the other members reach this daemon, `host:port`; empty = the first TCP address of
  // `listen`, which suffices if the others reach that. Set it if the daemon listens on all addresses of the machine.
  std::string advertise;

  // Part of the site that fails as one, such as a rack; empty = none. Shown with the members of the cluster.
  std::string zone;

  // `standbys`: the engine has synchronous standbys, without which it is refused. `storage`: the engine has none,
  // because its storage copies each change, as that of some managed databases does.
  ReplicatedBy engine_replication = ReplicatedBy::kStandbys;

  // When a scene's updates in the log have this size in bytes, they are replaced by a snapshot of the scene. For a
  // scene that is larger than this value, the size of the scene is used instead. Lower the value for a faster start and
  // a smaller directory; raise it if the log of updates uses most of the disk's bandwidth.
  uint64_t snapshot_after = limits::kSnapshotAfterBytes;

  // Number of threads that may work on one query batch; 0 = one for each core that this process may use by its affinity
  // and its control group. Answers do not depend on the number. Lower it to leave cores to other processes.
  uint32_t threads = 0;

  // Priority of the threads that work on large query batches, relative to the threads that talk to clients and apply
  // updates: `nice` is 10 nice levels lower; `idle` runs only on cores that are otherwise idle. With `idle`, small
  // calls wait half as long as with `nice` while large batches run, but large batches stop if other processes use all
  // cores.
  BatchPriority batch_priority = BatchPriority::kNice;

  // Vector instructions that queries use: a name that `locusd` logs at its start, or portable for none; empty = the
  // widest that the processor has. Answers do not depend on the choice. Change it to compare instruction sets, or to
  // rule out a fault of the processor.
  std::string instruction_set;

  // Lowest level that is logged to standard error. `debug` adds a line for each refused call.
  LogLevel log_level = LogLevel::kInfo;

  // Format of log lines. `json` writes one object a line, for log collectors.
  LogFormat log_format = LogFormat::kText;

  // Milliseconds after which a query batch is logged as slow, measured from the time when its revision is available to
  // the time of its answer; 0 = no batch is logged. At most a few warnings a second are logged. Lower the value to find
  // out what makes a server slow.
  uint32_t slow_query_ms = 1000;

  // Limits that may be lowered but not raised above their defaults; the refusal of a call names the exceeded limit.
  // Lower them if memory is short or there are many callers.
  uint32_t max_receive_bytes = limits::kReceiveBytes;  // maximum size of one message
  uint32_t max_scenes = limits::kMaxScenes;
  uint32_t max_meshes = limits::kMaxMeshes;
  uint32_t max_streams = limits::kMaxStreams;  // maximum number of open update and query streams of one client
  uint32_t max_calls = limits::kMaxCalls;      // maximum number of concurrent calls of one client, not counting streams

  // Accepts messages that are compressed with gzip; they may inflate to `max_receive_bytes`. If false, such messages
  // are refused. Set this option if the network is slower than gzip, which takes 3 ms for each MiB. Strangers can then
  // use up processor time by sending compressed messages.
  bool accept_compression = false;

  // Three maxima: the number of connections of all clients (0 = 4096, or fewer if the process may open only few files),
  // the number of connections of one address, and the number of connections that one address may open in a second, on
  // average. In a burst, an address may open twice `max_new_connections`. For unix sockets, each user counts as an
  // address. Excess connections are closed immediately. Raise the last two maxima if many clients share one address, as
  // behind a proxy.
  uint32_t max_connections = 0;
  uint32_t max_connections_per_address = 1024;
  uint32_t max_new_connections = 200;

  // Timeout in seconds for each of two steps of a new connection: the client sends its first bytes; then it completes
  // the TLS handshake, if there is TLS, and begins HTTP/2. After a timeout the connection is closed. Raise the value
  // for clients on very slow networks.
  uint32_t handshake_timeout_s = 10;

  // Seconds after which a connection without an open call is closed; 0 = never. A client opens a new connection with
  // its next call. Set this option if clients leave many connections behind.
  uint32_t idle_timeout_s = 0;

  // Bytes of memory that the process may use; 0 = three quarters of the memory of the machine or its control group. As
  // memory runs short, histories lose their oldest ticks first. Then calls are refused, depending on how much of the
  // limit is in use: uploads, dumps, inserts and placements from 7/8 on, moves from 29/32 on, and queries from 15/16
  // on. With a limit above 1 GiB, queries are refused only when less than 64 MiB are left. This remainder is a reserve
  // for small messages and answers. Removals are never refused. Lower the option to leave memory to other processes.
  // With a value above the default, the kernel may kill the process.
  uint64_t memory_limit = 0;

  // Bytes of replaced data per scene that batches and dumps may keep alive by reading older revisions; 0 selects the
  // default. The default is 256 MiB, or four times the size of the scene if that is more; with a `memory_limit` below 1
  // GiB it is a quarter of that limit. If the readers keep more bytes alive, the oldest readers are cancelled, and
  // updates wait until these readers have ended. Lower the value if memory is short; batches that run for several ticks
  // are then cancelled sooner.
  uint64_t pinned_limit = 0;

  // Seconds that running calls may take to finish after SIGTERM. Raise it if batches run long; keep it below the time
  // after which the service manager kills the process.
  uint32_t drain_grace_s = 10;

  // Process id of the process that starts the daemon; 0 = none. When this process has ended, in whatever way, the
  // daemon ends as after SIGTERM. Set it if the daemon serves only the program that starts it.
  uint32_t end_with_parent = 0;

  // Files of the server's certificate chain and its key, in PEM; both or none. With them, all TCP connections use TLS
  // 1.2 or 1.3, including those of the HTTP pages. The files are read again when they change.
  std::string tls_cert;
  std::string tls_key;

  // File of CA certificates in PEM, one of which must have signed the certificate of each client. Empty = clients need
  // no certificate. Set it to admit only machines that hold a certificate.
  std::string tls_client_ca;

  // File of the access rules: which caller may make which calls. If the option is empty, every client may make every
  // call; if it is empty but there is a token file or JWKS file, every client with a valid token, JWT or certificate
  // may make every call.
  std::string access_file;

  // Files for the authentication of clients: hashes of the accepted tokens, and public keys (JWKS) that verify signed
  // tokens (JWT); empty = none.
  std::string token_file;
  std::string jwks_file;

  // Values that the claims `aud` and `iss` of a JWT must have. With a JWKS file, `jwt_audience` is required; if
  // `jwt_issuer` is empty, `iss` is not checked.
  std::string jwt_audience;
  std::string jwt_issuer;

  // File to which calls that change something are logged, one JSON object a line; empty = none. Refused calls are
  // written to a second file, whose name has `.refused` appended. Each of the two files is replaced by a new file when
  // it is larger than `audit_bytes`; four older files of each are kept.
  std::string audit_file;
  uint64_t audit_bytes = uint64_t{64} << 20;

  // Allows the daemon to serve other machines without encryption and authentication. Use it only behind a proxy or in a
  // network where every machine is trusted.
  bool insecure = false;
};

// Function that returns the value of an environment variable, or nullopt if the variable is not set.
using Environment = std::function<std::optional<std::string>(const std::string&)>;

// Returns the value of a variable in the environment of this process, or nullopt if it is not set. Can be passed as an
// Environment.
std::optional<std::string> process_environment(const std::string& name);

// Command that runs instead of the server: `locusd check` or `locusd repair`, for a data directory that no daemon is
// using, or `locusd config`.
struct Maintenance {
  enum class Task : uint8_t { kCheck, kRepair, kShowConfig };
  Task task = Task::kCheck;
  std::string directory;                            // data directory, for check and repair
  bool json = false;                                // whether to print JSON, for config
  ProgressChoice progress = ProgressChoice::kAuto;  // when to show progress, for check and repair
};

// Parsed command line. If `config` is set, main() runs the server; if `maintenance` is set, main() runs that command;
// otherwise main() prints `text` and ends with `exit_code`. The exit code is 0 after --help, --version and the command
// `config`, and 2 after a mistake, which `text` explains.
struct Invocation {
  std::optional<ServerConfig> config;
  std::optional<Maintenance> maintenance;
  int exit_code = 0;
  std::string text;
};

// Parses `arguments` (without the program's name), the environment and the file of --config. Never ends the process.
// The returned config has passed check_config(), and its `threads` and `memory_limit` are not 0.
Invocation read_invocation(const std::vector<std::string>& arguments, const Environment& environment);

// Replaces `threads` and `memory_limit` by the defaults for this machine if they are 0. Reduces `threads` to
// limits::kMaxThreads if it is larger.
void follow_machine(ServerConfig& config);

// Returns INVALID_ARGUMENT if an address cannot be parsed, or if other machines can reach it and `config` has neither
// TLS with an access file nor `insecure`. Returns INVALID_ARGUMENT, too, if `unix_mode` is malformed, or if an option
// is set without another option that it needs.
absl::Status check_config(const ServerConfig& config);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_SERVER_CONFIG_H_
