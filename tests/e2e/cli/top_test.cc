// `locus top` against a real server.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/cli/run.h"
#include "core/base/block_kind.h"
#include "server/security/token_file.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

server::ServerConfig with_http() {
  server::ServerConfig config = test_config();
  config.http_listen = "127.0.0.1:0";
  return config;
}

// Writes a file that only its owner may read. Returns its path.
std::string write_private(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
  std::ofstream(folder.file(name)) << text;
  std::filesystem::permissions(folder.file(name), std::filesystem::perms::owner_read);
  return folder.file(name);
}

Outcome run_top(const std::string& address, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"top", "--metrics-address", address, "--interval", "0.1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  const cli::ExitCode code = cli::run_line(arguments, context);
  return {code, out.str(), err.str()};
}

class TopTest : public RpcTest {
 protected:
  TopTest() : RpcTest(with_http()) {}

  std::string http() { return "127.0.0.1:" + std::to_string(running_.server().http_port()); }
};

TEST_F(TopTest, OnceAsJsonIsOneDocument) {
  ASSERT_TRUE(apply(insert_balls(1, 5)).ok());
  const Outcome outcome = run_top(http(), {"--once", "--json"});
  ASSERT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  const Json top = Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  EXPECT_EQ(top["server"]["ready"], true);
  EXPECT_GT(top["server"]["memory_bytes"], 0);
  ASSERT_EQ(top["scenes"].size(), 1u);
  EXPECT_EQ(top["scenes"][0]["scene"], "world");
  EXPECT_EQ(top["scenes"][0]["objects"], 5);
  EXPECT_EQ(top["queries"].size(), kBlockKinds);
}

Outcome run_top_of(const std::string& address) {
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  const cli::ExitCode code =
      cli::run_line({"--address", address, "top", "--once", "--json", "--interval", "0.1"}, context);
  return {code, out.str(), err.str()};
}

TEST_F(TopTest, TheServerSaysItsHttpPort) {
  const Outcome outcome = run_top_of(running_.address());
  ASSERT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false)["server"]["ready"], true);
}

using TopWithoutHttpTest = RpcTest;

TEST_F(TopWithoutHttpTest, AServerWithoutHttpPortIsReported) {
  const Outcome outcome = run_top_of(running_.address());
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("no HTTP port"));
}

TEST_F(TopTest, OnceAsATableNamesTheSceneAndHasNoEscapes) {
  const Outcome outcome = run_top(http(), {"--once"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("world"));
  EXPECT_THAT(outcome.out, HasSubstr("revisions_per_s"));
  EXPECT_EQ(outcome.out.find('\x1b'), std::string::npos);
}

TEST_F(TopTest, ASignalEndsItWithZero) {
  // Blocks the signal, so that the signal stays pending until `top` waits for it.
  sigset_t interrupt;
  sigset_t before;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, &before);
  pthread_kill(pthread_self(), SIGINT);
  const Outcome outcome = run_top(http(), {});
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
}

TEST_F(TopTest, AnUnreachableServerIsReportedWithAHint) {
  const Outcome outcome = run_top("127.0.0.1:1", {"--once"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kUnreachable);
  EXPECT_THAT(outcome.err, HasSubstr("--http-listen"));
}

TEST(TopRightsTest, ATokenIsSentAndARefusalSaysWhichRightIsMissing) {
  const TemporaryFolder folder;
  const TestAuthority authority("authority");
  const TestCertificate pair = authority.for_server();
  server::ServerConfig config = with_http();
  config.access_file = write_private(folder, "access", "grant token:scraper metrics\ngrant token:other backup\n");
  config.token_file = folder.file("tokens");
  const std::string scraper =
      write_private(folder, "a", *server::add_token(config.token_file, "scraper", 1'000'000, {}, ""));
  const std::string other =
      write_private(folder, "b", *server::add_token(config.token_file, "other", 1'000'000, {}, ""));
  config.tls_cert = write_private(folder, "crt", pair.certificate);
  config.tls_key = write_private(folder, "key", pair.key);
  const std::string ca = write_private(folder, "ca", authority.certificate());
  RunningServer running(config);
  const std::string http = "127.0.0.1:" + std::to_string(running.server().http_port());
  EXPECT_EQ(run_top(http, {"--once", "--ca", ca, "--token-file", scraper}).code, cli::ExitCode::kOk);
  EXPECT_THAT(run_top(http, {"--once", "--ca", ca, "--token-file", other}).err, HasSubstr("lacks the right metrics"));
  EXPECT_THAT(run_top(http, {"--once", "--ca", ca}).err, HasSubstr("needs the right metrics"));
  EXPECT_NE(run_top(http, {"--once", "--token-file", scraper}).code, cli::ExitCode::kOk) << "without TLS";
}

TEST(TopServerNameTest, TheCertificateIsCheckedAgainstTheServerName) {
  const TemporaryFolder folder;
  const TestAuthority authority("authority");
  const TestCertificate pair = authority.issue({.common_name = "game", .alternative_names = "DNS:game.example.com"});
  server::ServerConfig config = with_http();
  config.tls_cert = write_private(folder, "crt", pair.certificate);
  config.tls_key = write_private(folder, "key", pair.key);
  const std::string ca = write_private(folder, "ca", authority.certificate());
  RunningServer running(config);
  const std::string http = "127.0.0.1:" + std::to_string(running.server().http_port());
  EXPECT_THAT(run_top(http, {"--once", "--ca", ca}).err, HasSubstr("--server-name"));
  EXPECT_EQ(run_top(http, {"--once", "--ca", ca, "--server-name", "game.example.com"}).code, cli::ExitCode::kOk);
  EXPECT_NE(run_top(http, {"--once", "--ca", ca, "--server-name", "other.example.com"}).code, cli::ExitCode::kOk);
}

TEST_F(TopTest, AGrpcPortOrAnInvalidAddressIsAnError) {
  const Outcome grpc = run_top(running_.address(), {"--once"});
  EXPECT_NE(grpc.code, cli::ExitCode::kOk);
  const Outcome nothing = run_top("not an address", {"--once"});
  EXPECT_NE(nothing.code, cli::ExitCode::kOk);
}

}  // namespace
}  // namespace locus::test
