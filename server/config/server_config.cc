#include "server/config/server_config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "core/base/check.h"
#include "core/base/similar_word.h"
#include "core/base/status_macros.h"
#include "server/config/config_file.h"
#include "server/config/config_origins.h"
#include "server/config/connection_limits.h"
#include "server/config/listen_address.h"
#include "server/config/machine.h"
#include "server/config/observability_limits.h"
#include "server/config/server_parser.h"
#include "server/config/version.h"

namespace locus::server {
namespace {

constexpr absl::string_view kListen = "--listen";

constexpr const char* kDescription =
    "locusd hosts scenes of static meshes and moving objects, and answers exact batched\n"
    "ray, ball and box queries over gRPC (locus.v1) while updates stream in.\n"
    "With --data-dir, scenes and every acknowledged update survive a restart; without it,\n"
    "scenes are in memory only and are lost when the daemon ends.";

constexpr const char* kFooter = R"(Every option can also be set by the environment or by the file that --config
names: --drain-grace-s 5, LOCUS_DRAIN_GRACE_S=5 and the line `drain-grace-s = 5`
mean the same. A flag wins over the environment, which wins over the file.

Examples:
  locusd                                      serve this machine on 127.0.0.1:7575
  locusd --listen unix:/run/locus/locus.sock  serve this machine over a unix socket
  locusd --listen 127.0.0.1:0 --port-file p   take a free port and write it to the file p
  locusd --data-dir /var/lib/locus            keep scenes, and every acknowledged update
  locusd --listen 0.0.0.0:7575 --tls-cert server.crt --tls-key server.key \
    --access-file access.conf                 serve other machines
  locusd check /var/lib/locus                 verify the data directory
  locusd config --config /etc/locus/locusd.conf   print the options in use, and their origin
  locusd --config /etc/locus/locusd.conf --log-format json

Try it: locus health; locus limits; locus scene create demo; locus top
/metrics, /healthz and /readyz are served on 127.0.0.1:7576, over TLS with --tls-cert;
with access control, /metrics needs a token or certificate with the right `metrics`.
Values of all options, and their origin: locusd config
It ends on SIGTERM or SIGINT once calls in work are done, with exit code 0; a
second signal ends it at once.)";

template <class T>
std::string name_of(const std::map<std::string, T>& names, T value) {
  for (const auto& [name, named] : names)
    if (named == value) return name;
  return "";
}

enum class ZeroBytes : uint8_t { kAllowed, kRefused };

// Returns a validator that accepts sizes from `min` bytes to limits::kMaxMemory, and 0 if `zero` allows it. `min_text`
// is the text of `min` in the error. CLI11 has already converted a size such as 16MiB to a plain number.
CLI::Validator size_from(uint64_t min, const char* min_text, ZeroBytes zero) {
  const auto check = [min, min_text, zero](const std::string& text) -> std::string {
    uint64_t bytes = 0;
    const bool is_number = absl::SimpleAtoi(text, &bytes);
    if (is_number && bytes >= min && bytes <= limits::kMaxMemory) return "";
    if (zero == ZeroBytes::kRefused) return absl::StrCat(text, " bytes is not in ", min_text, " .. 1PiB");
    return is_number && bytes == 0 ? "" : absl::StrCat(text, " bytes is neither 0 nor in ", min_text, " .. 1PiB");
  };
  return CLI::Validator(check, "");
}

void add_connection_options(CLI::App& app, ServerConfig& config) {
  app.add_option("--unix-mode", config.unix_mode, "Permissions of unix sockets, in octal")->capture_default_str();
  app.add_option("--unix-owner", config.unix_owner, "Owner of unix sockets: user or user:group")->capture_default_str();
  app.add_option("--max-connections", config.max_connections,
                 "Maximum number of connections; 0 = 4096, or fewer if few files may be open")
      ->check(CLI::Range(0u, kMaxConnections))
      ->capture_default_str();
  app.add_option("--max-connections-per-address", config.max_connections_per_address,
                 "Maximum number of connections from one address, or from one user of a unix socket")
      ->check(CLI::Range(1u, kMaxConnections))
      ->capture_default_str();
  app.add_option("--max-new-connections", config.max_new_connections,
                 "Maximum number of new connections a second from one address")
      ->check(CLI::Range(1u, kMaxNewConnections))
      ->capture_default_str();
  app.add_option("--handshake-timeout-s", config.handshake_timeout_s,
                 "Seconds that a client may take to begin TLS and HTTP/2")
      ->check(CLI::Range(1u, kMaxTimeoutS))
      ->capture_default_str();
  app.add_option("--idle-timeout-s", config.idle_timeout_s,
                 "Seconds after which a connection without open calls is closed; 0 = never")
      ->check(CLI::Range(0u, kMaxTimeoutS))
      ->capture_default_str();
}

void add_security_options(CLI::App& app, ServerConfig& config) {
  const auto add_text = [&app](const char* name, std::string& value, const char* what) {
    app.add_option(name, value, what)->capture_default_str();
  };
  add_text("--tls-cert", config.tls_cert,
           "File of the server's certificate chain (PEM); with it, TCP connections use TLS");
  add_text("--tls-key", config.tls_key, "File of the certificate's key (PEM)");
  add_text("--tls-client-ca", config.tls_client_ca,
           "File of CA certificates (PEM); every client needs a certificate that one of them signed");
  add_text("--access-file", config.access_file, "File that says who may call what");
  add_text("--token-file", config.token_file, "File of the tokens that identify clients");
  add_text("--jwks-file", config.jwks_file, "File of the keys (JWKS) that sign clients' tokens (JWT)");
  add_text("--jwt-audience", config.jwt_audience, "Value that the claim aud of a JWT must have");
  add_text("--jwt-issuer", config.jwt_issuer, "Value that the claim iss of a JWT must have");
  add_text("--audit-file", config.audit_file,
           "File to write changing calls to, as JSON lines; refused calls are written to FILE.refused");
  app.add_option("--audit-bytes", config.audit_bytes, "Size at which a new audit file is begun, such as 64MiB")
      ->transform(CLI::AsSizeValue(false).description("SIZE"))
      ->check(size_from(kMinAuditBytes, "64KiB", ZeroBytes::kRefused))
      ->capture_default_str();
}

void add_storage_options(CLI::App& app, ServerConfig& config) {
  app.add_option("--data-dir", config.data_dir, "Directory that scenes are kept in; empty = memory only")
      ->capture_default_str();
  app.add_option("--snapshot-after", config.snapshot_after,
                 "Size of a scene's log after which a snapshot replaces it, such as 16MiB")
      ->transform(CLI::AsSizeValue(false).description("SIZE"))
      ->check(size_from(limits::kMinSnapshotAfterBytes, "64KiB", ZeroBytes::kRefused))
      ->capture_default_str();
  app.add_option("--cluster", config.cluster,
                 "Replicated PostgreSQL of the cluster to join: postgresql://host,host,host/database; empty = none")
      ->capture_default_str();
  app.add_option("--advertise", config.advertise,
                 "Address at which clients and members of the cluster reach this daemon [the first of --listen]")
      ->capture_default_str();
  app.add_option("--zone", config.zone, "Part of the site that fails as one, such as a rack")->capture_default_str();
  const std::map<std::string, ReplicatedBy> copies = {{"standbys", ReplicatedBy::kStandbys},
                                                      {"storage", ReplicatedBy::kStorage}};
  app.add_option("--engine-replication", config.engine_replication,
                 "Who copies changes to a second machine: standbys of PostgreSQL, or its storage")
      ->transform(CLI::CheckedTransformer(copies).description(""))
      ->default_str(name_of(copies, config.engine_replication));
}

// Adds all options to the parser, which keeps pointers into `config` and writes the parsed values there.
void add_options(CLI::App& app, ServerConfig& config) {
  app.add_option("--listen", config.listen, "Address to listen on: host:port, [v6]:port or unix:/path; repeatable")
      ->delimiter(',')
      ->expected(1, static_cast<int>(limits::kMaxListenAddresses))
      ->take_all()
      ->capture_default_str();
  app.add_option("--port-file", config.port_file, "File to write the first TCP port to once the daemon answers")
      ->capture_default_str();
  app.add_option("--http-listen", config.http_listen,
                 "Address of the HTTP port with /metrics, /healthz and /readyz; empty = none")
      ->capture_default_str();
  app.add_option("--http-port-file", config.http_port_file, "File to write the HTTP port to once it answers")
      ->capture_default_str();
  add_storage_options(app, config);
  app.add_option("--threads", config.threads,
                 "Threads that may work on one batch; 0 = the cores that the process may use")
      ->check(CLI::Range(0u, limits::kMaxThreads))
      ->capture_default_str();
  const std::map<std::string, BatchPriority> priorities = {{"nice", BatchPriority::kNice},
                                                           {"idle", BatchPriority::kIdle}};
  app.add_option("--batch-priority", config.batch_priority,
                 "Priority of threads on large batches: nice, 10 below all others, or idle, only on idle cores")
      ->transform(CLI::CheckedTransformer(priorities).description(""))
      ->default_str(name_of(priorities, config.batch_priority));
  app.add_option("--instruction-set", config.instruction_set,
                 "Vector instructions of queries: avx2, sse4 or portable [the widest of the processor]")
      ->capture_default_str();
  const std::map<std::string, LogLevel> levels = {{"debug", LogLevel::kDebug},
                                                  {"info", LogLevel::kInfo},
                                                  {"warning", LogLevel::kWarning},
                                                  {"error", LogLevel::kError}};
  app.add_option("--log-level", config.log_level, "debug, info, warning or error")
      ->transform(CLI::CheckedTransformer(levels).description(""))
      ->default_str(name_of(levels, config.log_level));
  const std::map<std::string, LogFormat> formats = {{"text", LogFormat::kText}, {"json", LogFormat::kJson}};
  app.add_option("--log-format", config.log_format, "text, or json: one object a line")
      ->transform(CLI::CheckedTransformer(formats).description(""))
      ->default_str(name_of(formats, config.log_format));
  app.add_option("--slow-query-ms", config.slow_query_ms,
                 "Log query batches that take longer, in milliseconds; 0 = none")
      ->check(CLI::Range(0u, kMaxSlowQueryMs))
      ->capture_default_str();
  const auto add_limit = [&app](const char* name, uint32_t& value, const char* what) {
    app.add_option(name, value, what)->check(CLI::Range(1u, value))->capture_default_str();
  };
  add_limit("--max-receive-bytes", config.max_receive_bytes, "Largest message that is received");
  app.add_flag("--accept-compression", config.accept_compression,
               "Accept messages that are compressed with gzip, inflated up to --max-receive-bytes");
  add_limit("--max-scenes", config.max_scenes, "Maximum number of scenes");
  add_limit("--max-meshes", config.max_meshes, "Maximum number of meshes");
  add_limit("--max-streams", config.max_streams,
            "Maximum number of open streams of one client; all together may have a third more");
  add_limit("--max-calls", config.max_calls,
            "Maximum number of calls of one client at once, without streams; all together may have a third more");
  app.add_option("--memory-limit", config.memory_limit,
                 "Memory in use before uploads and inserts are refused, such as 512MiB; 0 = 3/4 of all")
      ->transform(CLI::AsSizeValue(false).description("SIZE"))
      ->check(size_from(limits::kMinMemory, "64MiB", ZeroBytes::kAllowed))
      ->capture_default_str();
  app.add_option("--pinned-limit", config.pinned_limit,
                 "Replaced data that readers may keep, per scene; 0 = 256MiB or 4 times the scene")
      ->transform(CLI::AsSizeValue(false).description("SIZE"))
      ->check(size_from(limits::kMinPinnedBytes, "1MiB", ZeroBytes::kAllowed))
      ->capture_default_str();
  app.add_option("--drain-grace-s", config.drain_grace_s, "Seconds that running calls may take after SIGTERM")
      ->check(CLI::Range(0u, limits::kMaxDrainGraceS))
      ->capture_default_str();
  app.add_option("--end-with-parent", config.end_with_parent,
                 "Process id of the process that starts the daemon, which then ends together with it; 0 = none")
      ->capture_default_str();
  add_connection_options(app, config);
  add_security_options(app, config);
  app.add_flag("--insecure", config.insecure, "Listen beyond this machine without encryption or access control");
}

void describe(CLI::App& app) {
  app.name("locusd");
  app.description(kDescription);
  app.footer(kFooter);
  app.set_version_flag("--version", absl::StrCat("locusd ", kVersion));
  app.allow_config_extras(CLI::config_extras_mode::error);
}

// Parses `arguments` with `app`. Reverses them first, because CLI11 expects them in reverse order.
void parse(CLI::App& app, std::vector<std::string> arguments) {
  std::reverse(arguments.begin(), arguments.end());
  app.parse(std::move(arguments));
}

// Returns `arguments` with options of the environment added as flags. In CLI11 the file wins over the environment; here
// the environment must win. So this function parses the flags alone, and adds every option that the environment sets
// but no flag sets. The file then sets only the remaining options.
std::vector<std::string> with_environment(const std::vector<std::string>& arguments, const Environment& environment) {
  ServerConfig ignored;
  std::string ignored_file;
  CLI::App app;
  describe(app);
  add_options(app, ignored);
  app.add_option("--config", ignored_file);
  std::optional<Maintenance> ignored_maintenance;
  add_maintenance(app, ignored_maintenance);
  parse(app, arguments);
  std::vector<std::string> all = arguments;
  for (const CLI::Option* option : std::as_const(app).get_options()) {
    if (option->count() > 0 || option->get_lnames().empty() || !option->get_configurable()) continue;
    const std::string& name = option->get_lnames().front();
    const std::optional<std::string> value = environment(environment_variable(name));
    if (!value) continue;
    if (!value->empty()) all.push_back(absl::StrCat("--", name, "=", *value));
    if (value->empty() && may_be_empty(name)) all.insert(all.end(), {absl::StrCat("--", name), ""});
  }
  return all;
}

// Returns an error unless `config` has TLS and an access file. Call it for an address that other machines can reach.
// `option` is the option that sets the address. `exposed` is text for the error: what anyone could do without TLS and
// access control.
absl::Status check_protected(const ServerConfig& config, absl::string_view option, absl::string_view address,
                             absl::string_view exposed) {
  std::vector<std::string> missing;
  std::string command = absl::StrCat("locusd ", option, " ", address);
  const auto need = [&](const char* flag, const std::string& value, const char* example) {
    absl::StrAppend(&command, " ", flag, " ", value.empty() ? example : value);
    if (value.empty()) missing.emplace_back(flag);
  };
  need("--tls-cert", config.tls_cert, "server.crt");
  need("--tls-key", config.tls_key, "server.key");
  need("--access-file", config.access_file, "access.conf");
  if (missing.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "`", address, "` can be reached from other machines, so it needs TLS and an access file; missing: ",
      absl::StrJoin(missing, ", "), ". For example:\n  ", command, "\nWithout them anyone there could ", exposed,
      ". There are two other ways:\n",
      "  1. Where only trusted machines reach it, such as a container whose port is published on its host's 127.0.0.1 ",
      "only, say so with LOCUS_INSECURE=1 or --insecure.\n", "  2. Otherwise listen on ",
      option == kListen ? "127.0.0.1, [::1] or a unix socket." : "127.0.0.1 or [::1]."));
}

absl::Status check_tls(const ServerConfig& config) {
  if (config.tls_cert.empty() != config.tls_key.empty())
    return absl::InvalidArgumentError("--tls-cert and --tls-key belong together; give both or none");
  if (!config.tls_client_ca.empty() && config.tls_cert.empty())
    return absl::InvalidArgumentError(
        "--tls-client-ca needs --tls-cert and --tls-key, because only TLS has certificates");
  return absl::OkStatus();
}

absl::Status check_http(const ServerConfig& config) {
  if (config.http_listen.empty()) {
    if (config.http_port_file.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("--http-port-file needs an HTTP port; give --http-listen an address");
  }
  ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(config.http_listen));
  if (address.kind != ListenAddress::Kind::kTcp)
    return absl::InvalidArgumentError("--http-listen takes host:port or [v6]:port, because scrapers use TCP");
  if (address.local || config.insecure) return absl::OkStatus();
  return check_protected(config, "--http-listen", config.http_listen, "read the names of scenes and how they are used");
}

Invocation mistake(absl::string_view message) {
  Invocation invocation;
  invocation.exit_code = 2;
  invocation.text = absl::StrCat("locusd: ", message, "\nRun `locusd --help` for the options.\n");
  return invocation;
}

// Returns the message for a command line with unexpected words. The parser's own message lists them in reverse order.
std::string unexpected(const std::vector<std::string>& arguments, absl::string_view message) {
  ServerConfig config;
  CLI::App app;
  std::optional<Maintenance> maintenance;
  build_parser(app, config);
  add_maintenance(app, maintenance);
  std::vector<const CLI::App*> commands = {&app};
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command);
  std::vector<std::string> names;
  for (const CLI::App* command : commands)
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back(absl::StrCat("--", name));
  for (const std::string& argument : arguments) {
    if (!absl::StartsWith(argument, "--")) continue;
    const std::string name = argument.substr(0, argument.find('='));
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const std::string similar = similar_word(name, names);
    return absl::StrCat("there is no option `", name, "`",
                        similar.empty() ? "" : absl::StrCat("; did you mean `", similar, "`?"));
  }
  return std::string(message);
}

// Parses and checks the command line into `invocation`. May throw CLI11's errors.
void parse_all(const std::vector<std::string>& arguments, const Environment& environment, Invocation& invocation) {
  ServerConfig config;
  CLI::App app;
  build_parser(app, config);
  add_maintenance(app, invocation.maintenance);
  const std::vector<std::string> all = with_environment(arguments, environment);
  try {
    parse(app, all);
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ExtrasError&) {
    throw;
  } catch (const CLI::Error& error) {
    invocation = mistake(with_line_of_file(app, all, error));
    return;
  }
  const bool show_config = invocation.maintenance && invocation.maintenance->task == Maintenance::Task::kShowConfig;
  if (invocation.maintenance && !show_config) {
    std::string& directory = invocation.maintenance->directory;
    if (directory.empty()) directory = config.data_dir;
    if (directory.empty()) invocation = mistake("no data directory: name it after the command, or with --data-dir");
    return;
  }
  if (const absl::Status status = check_config(config); !status.ok()) {
    invocation = mistake(status.message());
    return;
  }
  follow_machine(config);
  if (show_config) {
    invocation.text = print_config(config_values(arguments, environment, config), invocation.maintenance->json);
    invocation.maintenance.reset();
    return;
  }
  invocation.config = std::move(config);
}

Invocation help(const std::vector<std::string>& arguments) {
  ServerConfig config;
  CLI::App app;
  build_parser(app, config);
  Invocation invocation;
  add_maintenance(app, invocation.maintenance);
  // If the arguments name a command, show the help of that command instead of the daemon's.
  const CLI::App* asked = &app;
  for (const CLI::App* command : app.get_subcommands({}))
    if (std::find(arguments.begin(), arguments.end(), command->get_name()) != arguments.end()) asked = command;
  invocation.text = asked == &app ? app.help() : asked->help("locusd");
  return invocation;
}

// Checks the options of a cluster. `tcp`: the daemon listens on a TCP address.
absl::Status check_cluster(const ServerConfig& config, bool tcp) {
  if (config.cluster.empty()) {
    if (!config.advertise.empty() || !config.zone.empty())
      return absl::InvalidArgumentError("--advertise and --zone are for members of a cluster; give --cluster too");
    return absl::OkStatus();
  }
  if (!config.data_dir.empty())
    return absl::InvalidArgumentError(
        "--data-dir and --cluster exclude each other: the engine of the cluster stores the scenes; leave one out");
  if (!tcp) return absl::InvalidArgumentError("--cluster needs a TCP address among --listen, for the other members");
  if (config.advertise.empty()) {
    const auto unspecified = [](const std::string& text) {
      const absl::StatusOr<ListenAddress> address = parse_listen_address(text);
      return address.ok() && (address->host == "0.0.0.0" || address->host == "::");
    };
    if (std::any_of(config.listen.begin(), config.listen.end(), unspecified))
      return absl::InvalidArgumentError(
          "--cluster needs --advertise HOST:PORT if the daemon listens on all addresses of the machine");
    return absl::OkStatus();
  }
  const absl::StatusOr<ListenAddress> advertised = parse_listen_address(config.advertise);
  if (!advertised.ok() || advertised->kind != ListenAddress::Kind::kTcp || advertised->port == 0)
    return absl::InvalidArgumentError(
        absl::StrCat("--advertise is '", config.advertise, "'; give host:port, such as locus-0.locus:7575"));
  return absl::OkStatus();
}

}  // namespace

void follow_machine(ServerConfig& config) {
  const Machine machine = read_machine();
  config.threads = std::min(config.threads == 0 ? machine.cores : config.threads, limits::kMaxThreads);
  if (config.memory_limit == 0) config.memory_limit = machine.memory_bytes / 4 * 3;
  LOCUS_DCHECK_LE(1u, config.threads);
  LOCUS_DCHECK_LE(config.threads, limits::kMaxThreads);
}

void build_parser(CLI::App& app, ServerConfig& config) {
  describe(app);
  add_options(app, config);
  app.set_config("--config", "", "File with options, one `name = value` a line, # starts a comment");
}

void add_maintenance(CLI::App& app, std::optional<Maintenance>& chosen) {
  struct Command {
    const char* name;
    Maintenance::Task task;
    const char* description;
    const char* footer;
  };
  constexpr Command kCommands[] = {
      {"check", Maintenance::Task::kCheck,
       "Verify everything in a data directory, scene by scene. Changes\nnothing; no daemon may use the "
       "directory meanwhile. Exits 0 if all is intact.",
       "Examples:\n  locusd check /var/lib/locus"},
      {"repair", Maintenance::Task::kRepair,
       "Make a damaged data directory usable again, and report what is lost. Intact scenes\nare not changed; the old "
       "database is kept in the folder before-repair-N of the directory.\nIf there is a backup, `locus restore` loses "
       "less.",
       "Examples:\n  locusd check /var/lib/locus\n  locusd repair /var/lib/locus"}};
  for (const Command& command : kCommands) {
    CLI::App& added = *app.add_subcommand(command.name, command.description);
    added.footer(command.footer);
    added.fallthrough();
    const auto directory = std::make_shared<std::string>();
    added.add_option("DIRECTORY", *directory, "The data directory [that of --data-dir]");
    const auto progress = std::make_shared<ProgressChoice>(ProgressChoice::kAuto);
    added
        .add_option(
            "--progress", *progress,
            "When to show progress on standard error: auto (on a\nterminal), always (elsewhere a line a second), "
            "never [auto]")
        ->type_name("WHEN")
        ->transform(CLI::CheckedTransformer(std::map<std::string, ProgressChoice>{{"auto", ProgressChoice::kAuto},
                                                                                  {"always", ProgressChoice::kAlways},
                                                                                  {"never", ProgressChoice::kNever}})
                        .description(""));
    added.callback([&chosen, directory, progress, task = command.task] {
      chosen = Maintenance{.task = task, .directory = *directory, .json = false, .progress = *progress};
    });
  }
  CLI::App& config =
      *app.add_subcommand("config",
                          "Print the value that each option has with these flags, this environment and this file,\n"
                          "and its origin: flag, environment variable, file and line, or default. Starts nothing.");
  config.footer(
      "A flag wins over the environment (LOCUS_...), which wins over the file. Defaults that follow\n"
      "the machine, threads and memory-limit, are printed with their values here.\n\n"
      "Examples:\n  locusd config\n  locusd config --config /etc/locus/locusd.conf\n"
      "  locusd config --json --threads 2");
  config.fallthrough();
  const auto json = std::make_shared<bool>(false);
  config.add_flag("--json", *json, "Print one JSON object instead of a table");
  config.callback([&chosen, json] {
    chosen = Maintenance{.task = Maintenance::Task::kShowConfig, .directory = "", .json = *json};
  });
  app.require_subcommand(0, 1);
}

std::string environment_variable(const std::string& option) {
  return absl::StrCat("LOCUS_", absl::AsciiStrToUpper(absl::StrReplaceAll(option, {{"-", "_"}})));
}

bool may_be_empty(const std::string& option) {
  return option == "http-listen" || option == "data-dir" || option == "cluster";
}

std::optional<std::string> process_environment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  if (value == nullptr) return std::nullopt;
  return std::string(value);
}

Invocation read_invocation(const std::vector<std::string>& arguments, const Environment& environment) {
  try {
    Invocation invocation;
    parse_all(arguments, environment, invocation);
    return invocation;
  } catch (const CLI::CallForHelp&) {
    return help(arguments);
  } catch (const CLI::CallForVersion& version) {
    Invocation invocation;
    invocation.text = absl::StrCat(version.what(), "\n");
    return invocation;
  } catch (const CLI::ExtrasError& error) {
    return mistake(unexpected(arguments, error.what()));
  } catch (const CLI::Error& error) {
    return mistake(error.what());
  }
}

absl::Status check_config(const ServerConfig& config) {
  if (config.listen.empty()) return absl::InvalidArgumentError("no address to listen on; give --listen");
  if (config.listen.size() > limits::kMaxListenAddresses)
    return absl::InvalidArgumentError(absl::StrCat("more than ", limits::kMaxListenAddresses, " listen addresses"));
  RETURN_IF_ERROR(parse_unix_mode(config.unix_mode).status());
  RETURN_IF_ERROR(check_tls(config));
  bool tcp = false;
  for (const std::string& text : config.listen) {
    ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(text));
    if (!address.local && !config.insecure)
      RETURN_IF_ERROR(check_protected(config, kListen, text, "read and change every scene"));
    tcp = tcp || address.kind == ListenAddress::Kind::kTcp;
  }
  RETURN_IF_ERROR(check_cluster(config, tcp));
  if (!config.port_file.empty() && !tcp)
    return absl::InvalidArgumentError("--port-file needs a TCP address among --listen; a unix socket has no port");
  return check_http(config);
}

}  // namespace locus::server
