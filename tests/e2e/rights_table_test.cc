// Every rpc, called by every kind of identity with every set of rights: a row for each rpc says who may call it.
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "locus/rpc_paths.h"
#include "server/scheduling/clocks.h"
#include "server/security/token_file.h"
#include "tests/support/raw_call.h"
#include "tests/support/running_server.h"
#include "tests/support/signing_key.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::test {
namespace {

enum class Outcome { kServed, kDenied, kHidden, kUnknown };

// A column of the table: a set of rights. `grants` contains the lines of an access file that grant these rights to the
// caller WHO.
struct Column {
  const char* name;
  const char* grants;
};
constexpr std::array kColumns = std::to_array<Column>({
    {"reader", "grant WHO read arena-*\n"},
    {"updater", "grant WHO update arena-*\n"},
    {"admin", "grant WHO admin *\n"},
    {"meshes", "grant WHO meshes\n"},
    {"backup", "grant WHO backup\n"},
    {"metrics", "grant WHO metrics\n"},
    {"reflection", "grant WHO reflection\n"},
    {"elsewhere", "grant WHO admin lobby-*\n"},
    {"without rights", ""},
});
// Outcomes of a row: one for each set of rights, and the last one for a caller without credentials.
constexpr size_t kOutcomes = kColumns.size() + 1;
using Outcomes = std::array<Outcome, kOutcomes>;

struct RpcRow {
  std::string_view path;
  Outcomes outcomes;
};

constexpr Outcome kYes = Outcome::kServed, kNo = Outcome::kDenied, kHid = Outcome::kHidden, kWho = Outcome::kUnknown;
// Columns in order: reader, updater, admin, meshes, backup, metrics, reflection, elsewhere, without rights, without
// credentials.
constexpr Outcomes kReads = {kYes, kYes, kYes, kHid, kHid, kHid, kHid, kHid, kNo, kWho};
constexpr Outcomes kUpdates = {kNo, kYes, kYes, kHid, kHid, kHid, kHid, kHid, kNo, kWho};
constexpr Outcomes kDeletes = {kNo, kNo, kYes, kHid, kHid, kHid, kHid, kHid, kNo, kWho};
constexpr Outcomes kCreates = {kNo, kNo, kYes, kNo, kNo, kNo, kNo, kNo, kNo, kWho};
constexpr Outcomes kAdmins = kCreates;  // callers who administer all scenes
constexpr Outcomes kMeshes = {kNo, kNo, kNo, kYes, kNo, kNo, kNo, kNo, kNo, kWho};
constexpr Outcomes kBackups = {kNo, kNo, kNo, kNo, kYes, kNo, kNo, kNo, kNo, kWho};
constexpr Outcomes kReflects = {kNo, kNo, kNo, kNo, kNo, kNo, kYes, kNo, kNo, kWho};
constexpr Outcomes kKnown = {kYes, kYes, kYes, kYes, kYes, kYes, kYes, kYes, kNo, kWho};
constexpr Outcomes kAll = {kYes, kYes, kYes, kYes, kYes, kYes, kYes, kYes, kYes, kYes};

constexpr std::array kRows = std::to_array<RpcRow>({
    {"/locus.v1.QueryService/Query", kReads},
    {"/locus.v1.QueryService/StreamQueries", kReads},  // messages with an update: access_rpc_test.cc
    {"/locus.v1.QueryService/Step", kUpdates},
    {"/locus.v1.UpdateService/ApplyUpdates", kUpdates},
    {"/locus.v1.UpdateService/StreamUpdates", kUpdates},
    {"/locus.v1.SceneService/CreateScene", kCreates},
    {"/locus.v1.SceneService/GetScene", kReads},
    {"/locus.v1.SceneService/ListScenes", kKnown},
    {"/locus.v1.SceneService/DeleteScene", kDeletes},
    {"/locus.v1.SceneService/UpdateScene", kDeletes},
    {"/locus.v1.SceneService/UploadMesh", kMeshes},
    {"/locus.v1.SceneService/ListMeshes", kMeshes},
    {"/locus.v1.SceneService/DeleteMesh", kMeshes},
    {"/locus.v1.SceneService/DownloadMesh", kMeshes},
    {"/locus.v1.SceneService/ChangeInstances", kUpdates},
    {"/locus.v1.SceneService/DumpScene", kReads},
    {"/locus.v1.ServerService/GetServer", kKnown},
    {"/locus.v1.ServerService/GetQuotas", kAdmins},
    {"/locus.v1.ServerService/Backup", kBackups},
    {"/locus.v1.ServerService/MoveScene", kDeletes},  // served, although the answer is that there is no cluster
    {"/grpc.health.v1.Health/Check", kAll},
    {"/grpc.health.v1.Health/Watch", kAll},
    {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", kReflects},
});

// Returns whether an rpc has a row. The build fails if an rpc has no row, or if a row has no rpc.
constexpr bool has_row(std::string_view path) {
  return std::any_of(kRows.begin(), kRows.end(), [path](const RpcRow& row) { return row.path == path; });
}
static_assert(std::all_of(kRpcPaths.begin(), kRpcPaths.end(), has_row), "add the new rpc to kRows");
static_assert(kRows.size() == kRpcPaths.size());

// Returns the status of a call. Streams answer with errors in their messages.
grpc::Status status_of(std::string_view path, const RawReply& reply) {
  v1::StreamQueriesResponse queries;
  v1::StreamUpdatesResponse updates;
  v1::Error error;
  if (path.ends_with("/StreamQueries") && queries.ParseFromString(reply.bytes)) error = queries.error();
  if (path.ends_with("/StreamUpdates") && updates.ParseFromString(reply.bytes)) error = updates.error();
  if (!reply.status.ok() || error.code() == 0) return reply.status;
  return {static_cast<grpc::StatusCode>(error.code()), error.message()};
}

Outcome outcome_of(const grpc::Status& status) {
  if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED) return Outcome::kUnknown;
  if (status.error_code() == grpc::StatusCode::PERMISSION_DENIED) return Outcome::kDenied;
  const bool hidden = status.error_code() == grpc::StatusCode::NOT_FOUND &&
                      status.error_message() == "scene: no scene is called 'arena-1'; create it first";
  return hidden ? Outcome::kHidden : Outcome::kServed;
}

// A caller: its connection, the bearer token that it sends, and the principal under which the server knows it.
struct RpcCaller {
  std::shared_ptr<grpc::Channel> channel;
  std::string bearer;
  std::string principal;
};

// A server with mutual TLS on TCP, and with a unix socket.
class RightsTableTest : public ::testing::Test {
 protected:
  RightsTableTest() {
    const TestCertificate pair = authority_.for_server();
    write("crt", pair.certificate);
    write("key", pair.key);
    write("ca", authority_.certificate());
    write("jwks", absl::StrCat(R"({"keys":[)", key_.jwk(), "]}"));
    write("access", "grant token:root admin *\n");
    root_ = *server::add_token(folder_.file("tokens"), "root", 1'000'000, {}, "");
    token_ = *server::add_token(folder_.file("tokens"), "ann", 1'000'000, {}, "");
    running_.emplace(config());
    unix_channel_ = Stubs("unix:" + folder_.file("socket")).channel;
  }

  server::ServerConfig config() const {
    server::ServerConfig config = test_config();
    config.listen = {"127.0.0.1:0", "unix:" + folder_.file("socket")};
    config.tls_cert = folder_.file("crt");
    config.tls_key = folder_.file("key");
    config.tls_client_ca = folder_.file("ca");
    config.access_file = folder_.file("access");
    config.token_file = folder_.file("tokens");
    config.jwks_file = folder_.file("jwks");
    config.jwt_audience = "locus";
    return config;
  }
  void write(const std::string& name, const std::string& text) const {
    const std::string fresh = folder_.file(name) + ".new";
    std::ofstream(fresh) << text;
    std::filesystem::permissions(fresh, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::filesystem::rename(fresh, folder_.file(name));
  }

  RpcCaller by_token() const { return {unix_channel_, token_, "token:ann"}; }
  RpcCaller by_jwt() const {
    const std::string header = absl::StrCat(R"({"typ":"JWT","alg":")", key_.algorithm(), R"("})");
    const std::string claims = absl::StrCat(R"({"sub":"ann","aud":"locus","exp":)", server::unix_seconds() + 1000, "}");
    return {unix_channel_, key_.jwt(header, claims), "jwt:ann"};
  }
  RpcCaller by_unix_user() const {
    const passwd* const user = getpwuid(getuid());
    return {unix_channel_, "", absl::StrCat("user:", user == nullptr ? std::to_string(getuid()) : user->pw_name)};
  }
  RpcCaller by_certificate() const {
    const TestCertificate own = authority_.issue({.common_name = "ann"});
    const grpc::SslCredentialsOptions options{authority_.certificate(), own.key, own.certificate};
    return {grpc::CreateChannel(running_->address(), grpc::SslCredentials(options)), "", "cert:ann"};
  }

  static grpc::Status call(const RpcCaller& caller, std::string_view path) {
    const std::string scene = "arena-1";
    const std::string bytes = std::string("\x0a") + static_cast<char>(scene.size()) + scene;  // field 1
    const bool endless = path == "/grpc.health.v1.Health/Watch";
    return status_of(path, raw_call(caller.channel, std::string(path), bytes,
                                    endless ? std::chrono::milliseconds(300) : kCallTimeout, caller.bearer));
  }
  // Calls every rpc, and compares the outcomes with a column of the table.
  void expect_column(const RpcCaller& caller, size_t column, absl::string_view name) const {
    for (const RpcRow& row : kRows) {
      call({unix_channel_, root_, ""}, "/locus.v1.SceneService/CreateScene");
      const grpc::Status status = call(caller, row.path);
      EXPECT_EQ(outcome_of(status), row.outcomes[column])
          << row.path << " by " << caller.principal << ", " << name << ": " << status.error_code() << " "
          << status.error_message();
    }
  }
  // Gives the caller the rights of each column in turn, and calls expect_column() for the column.
  void expect_columns(const RpcCaller& caller) {
    for (size_t column = 0; column < kColumns.size(); ++column) {
      write("access", absl::StrCat("grant token:root admin *\n",
                                   absl::StrReplaceAll(kColumns[column].grants, {{"WHO", caller.principal}})));
      running_->server().reload();
      expect_column(caller, column, kColumns[column].name);
    }
  }

  const TestAuthority authority_{"authority"};
  const SigningKey key_ = SigningKey::ed25519();
  const TemporaryFolder folder_;
  std::string root_, token_;
  std::optional<RunningServer> running_;
  std::shared_ptr<grpc::Channel> unix_channel_;
};

TEST_F(RightsTableTest, RefusalsDuringReloadsHaveTheirProperError) {
  std::atomic<bool> over{false};
  std::thread reloading([&] {
    for (int i = 0; !over.load(); ++i) {
      write("access", absl::StrCat("grant token:root admin *\ngrant token:ann read arena-", i % 10, "\n"));
      running_->server().reload();
    }
  });
  for (int i = 0; i < 5000; ++i) {
    const grpc::Status status = call(by_token(), "/locus.v1.SceneService/CreateScene");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << status.error_message();
  }
  over.store(true);
  reloading.join();
}

TEST_F(RightsTableTest, EveryRpcIsServedOrRefusedByTheRightsOfATokenAsItsRowSays) { expect_columns(by_token()); }
TEST_F(RightsTableTest, EveryRpcIsServedOrRefusedByTheRightsOfAJwtAsItsRowSays) { expect_columns(by_jwt()); }
TEST_F(RightsTableTest, EveryRpcIsServedOrRefusedByTheRightsOfAUnixUserAsItsRowSays) { expect_columns(by_unix_user()); }
TEST_F(RightsTableTest, EveryRpcIsServedOrRefusedByTheRightsOfACertificateAsItsRowSays) {
  expect_columns(by_certificate());
}

TEST_F(RightsTableTest, ACallerWithoutCredentialsIsServedAsTheLastColumnSays) {
  running_.reset();
  server::ServerConfig plain = config();
  plain.tls_cert = plain.tls_key = plain.tls_client_ca = "";
  running_.emplace(plain);
  unix_channel_ = Stubs("unix:" + folder_.file("socket")).channel;
  expect_column({running_->stubs().channel, "", "nobody"}, kOutcomes - 1, "without credentials");
}

}  // namespace
}  // namespace locus::test
