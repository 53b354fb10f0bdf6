// A PostgreSQL server of its own for a test, in a temporary folder and on a Unix socket, so that no port is taken. The
// destructor ends it. PostgreSQL refuses to run as root, so root runs it as the user `postgres`.
//
// Threads: one at a time. The thread that starts a server must outlive it: the kernel ends the server with that thread.
#ifndef LOCUS_TESTS_SUPPORT_POSTGRES_SERVER_H_
#define LOCUS_TESTS_SUPPORT_POSTGRES_SERVER_H_

#include <gtest/gtest.h>
#include <libpq-fe.h>
#include <pwd.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "server/storage/postgres_log.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {

class PostgresServer {
 public:
  static constexpr const char* kPrograms = "/usr/lib/postgresql/15/bin/";
  static constexpr const char* kMissing = "PostgreSQL 15 is not installed: deploy/packages.sh test installs it";
  using Settings = std::vector<std::string>;  // such as "fsync=off"

  static bool installed() { return access(absl::StrCat(kPrograms, "initdb").c_str(), X_OK) == 0; }

  // Makes an empty database and starts the server.
  explicit PostgresServer(Settings settings = {}) : settings_(std::move(settings)) {
    own_folder();
    EXPECT_EQ(run("initdb", {"-D", data(), "-A", "trust", "-U", "postgres", "-E", "UTF8", "--locale=C", "--no-sync"}),
              0)
        << folder_.file("log");
    start();
  }
  // Starts a standby of `primary`, which copies it and then follows it under the name `name`.
  PostgresServer(PostgresServer& primary, const std::string& name) {
    own_folder();
    EXPECT_EQ(
        run("pg_basebackup", {"-D", data(), "-R", "--no-sync", "--checkpoint=fast", "-d",
                              absl::StrCat("host=", primary.folder_.path(), " user=postgres application_name=", name)}),
        0)
        << folder_.file("log");
    start();
  }
  ~PostgresServer() { stop(SIGQUIT); }
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  // Starts the server and waits until it answers.
  void start() {
    Settings arguments = {"-D", data(),
                          "-k", folder_.path(),
                          "-c", "listen_addresses=",
                          "-c", "max_connections=200",
                          "-c", "shared_buffers=16MB",
                          "-c", "dynamic_shared_memory_type=mmap"};
    for (const std::string& setting : settings_) arguments.insert(arguments.end(), {"-c", setting});
    process_ = as_postgres("postgres", arguments, "log");
    for (int i = 0; i < 3000; ++i) {
      if (query("SELECT 1") == "1") return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "PostgreSQL does not start: " << log();
  }
  // Ends the server: SIGQUIT without a checkpoint, SIGKILL as the kernel would. Its sessions end with it.
  void stop(int signal) {
    if (process_ == nullptr) return;
    process_->signal(signal);
    process_->wait();
    process_ = nullptr;
    // Sessions notice the end of a killed server by themselves, and a new one refuses to start before.
    for (int i = 0; i < 1000 && sessions_remain(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  void restart(int signal) {
    stop(signal);
    start();
  }
  const std::string& socket_folder() const { return folder_.path(); }

  // Returns what the server has logged since its last start.
  std::string log() const {
    std::ifstream file(folder_.file("log"));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  // Runs one SQL statement as the superuser and returns the first value, or the error.
  std::string query(const std::string& sql) const {
    const std::unique_ptr<PGconn, decltype(&PQfinish)> connection(
        PQconnectdb(absl::StrCat("host=", folder_.path(), " user=postgres dbname=postgres").c_str()), &PQfinish);
    if (PQstatus(connection.get()) != CONNECTION_OK) return PQerrorMessage(connection.get());
    const std::unique_ptr<PGresult, decltype(&PQclear)> result(PQexec(connection.get(), sql.c_str()), &PQclear);
    const ExecStatusType status = PQresultStatus(result.get());
    if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) return PQresultErrorMessage(result.get());
    return PQntuples(result.get()) > 0 ? PQgetvalue(result.get(), 0, 0) : "";
  }

  // Returns options for a log on this server, or on several servers of which one accepts writes.
  server::PostgresOptions options(const std::vector<const PostgresServer*>& others = {}) const {
    server::PostgresOptions options;
    std::string hosts = folder_.path();
    for (const PostgresServer* const other : others) absl::StrAppend(&hosts, ",", other->folder_.path());
    options.url = absl::StrCat("postgresql:///postgres?user=postgres&host=", hosts);
    options.replication = others.empty() ? server::EngineReplication::kStorage : server::EngineReplication::kStandbys;
    return options;
  }

 private:
  std::string data() const { return folder_.file("data"); }
  void own_folder() const {
    if (geteuid() != 0) return;
    const passwd* const user = getpwnam("postgres");
    ASSERT_NE(user, nullptr);
    ASSERT_EQ(chown(folder_.path().c_str(), user->pw_uid, user->pw_gid), 0);
  }
  std::unique_ptr<ChildProcess> as_postgres(const std::string& program, Settings arguments,
                                            const std::string& log) const {
    std::string path = absl::StrCat(kPrograms, program);
    if (geteuid() == 0) {
      arguments.insert(arguments.begin(),
                       {"--reuid=postgres", "--regid=postgres", "--clear-groups", "--pdeathsig=KILL", "--", path});
      path = "/usr/bin/setpriv";
    }
    return std::make_unique<ChildProcess>(path, arguments, folder_.file(log));
  }
  int run(const std::string& program, const Settings& arguments) const {
    return as_postgres(program, arguments, "log")->wait();
  }
  bool sessions_remain() const {
    // The server's sessions hold the lock of its shared memory, and initdb's data folder names it.
    return std::filesystem::exists(data() + "/postmaster.pid") && process_of_data() > 0;
  }
  // Returns the number of processes that work in the data folder.
  int process_of_data() const {
    int count = 0;
    std::error_code why;
    for (const auto& entry : std::filesystem::directory_iterator("/proc", why)) {
      const std::filesystem::path cwd = std::filesystem::read_symlink(entry.path() / "cwd", why);
      if (!why && cwd == data()) ++count;
    }
    return count;
  }

  const TemporaryFolder folder_;
  const Settings settings_;
  std::unique_ptr<ChildProcess> process_;
};

// Opens a log and makes it the leader of all scenes, as the only daemon of a cluster. Null, after a failure of the
// test, if that fails.
inline std::unique_ptr<server::PostgresLog> open_and_lead(const server::PostgresOptions& options) {
  auto log = server::PostgresLog::open(options);
  EXPECT_TRUE(log.ok()) << log.status();
  if (!log.ok()) return nullptr;
  for (const StoredScene& scene : (*log)->stored_scenes()) {
    const auto leader = (*log)->leader_of(scene.key);
    EXPECT_TRUE(leader.ok()) << leader.status();
    const auto taken = (*log)->take_over(scene.key, leader.ok() ? leader->token : 0);
    EXPECT_TRUE(taken.ok()) << taken.status();
  }
  return *std::move(log);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_POSTGRES_SERVER_H_
