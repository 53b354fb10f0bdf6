#include "client/lib/authorization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "client/lib/client.h"
#include "tests/client/lib/guarded_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::client {
namespace {

using testing::GuardedServer;
using ::testing::HasSubstr;
using ::testing::Not;

ClientOptions with(const CredentialOptions& credentials) {
  ClientOptions options;
  options.credentials = credentials;
  return options;
}

std::unique_ptr<Client> connected(const GuardedServer& server, const CredentialOptions& credentials) {
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(server.address(), with(credentials));
  EXPECT_TRUE(client.ok()) << client.status();
  return client.ok() ? *std::move(client) : nullptr;
}

TEST(StaysOnThisMachineTest, OnlyLoopbackAddressesAndUnixSocketsDo) {
  for (const char* target : {"unix:/run/locus.sock", "127.0.0.1:7575", "127.9.9.9:1", "localhost:7575", "[::1]:7575"})
    EXPECT_TRUE(stays_on_this_machine(target)) << target;
  for (const char* target : {"127.0.0.1.example.com:80", "localhost.example.com:80", "10.0.0.1:80", "[::2]:80",
                             "128.0.0.1:80", "dns:///127.0.0.1:80", "host:80", "0.0.0.0:80", "::1:80"})
    EXPECT_FALSE(stays_on_this_machine(target)) << target;
}

TEST(AuthorizationTest, ATokenIsNotSentToAnotherMachineWithoutTls) {
  const absl::Status refused = Authorization::make({.token = "secret"}, "example.com:80").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("connect with TLS"));
  EXPECT_TRUE(Authorization::make({.tls = true, .token = "secret"}, "example.com:80").ok());
  EXPECT_TRUE(Authorization::make({.token = "secret", .allow_token_without_tls = true}, "example.com:80").ok());
  EXPECT_TRUE(Authorization::make({}, "example.com:80").ok());
}

TEST(AuthorizationTest, AMalformedTokenIsRefusedWithoutBeingRepeated) {
  for (const std::string& token : {std::string("two words"), std::string("line\nbreak"), std::string("\xC3\xA4"),
                                   std::string(kMaxTokenBytes + 1, 'x')}) {
    const absl::Status refused = Authorization::make({.token = token}, "127.0.0.1:80").status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << token;
    EXPECT_THAT(std::string(refused.message()), Not(HasSubstr(token)));
  }
  EXPECT_EQ(Authorization::make({.token = "a", .token_file = "b"}, "127.0.0.1:80").status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(absl::IsNotFound(Authorization::make({.token_file = "/nonexistent/token"}, "127.0.0.1:80").status()));
}

TEST(AuthorizationTest, EveryCallCarriesTheToken) {
  GuardedServer server;
  server.require("secret");
  const std::unique_ptr<Client> client = connected(server, {.token = "secret"});
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_TRUE(client->query("arena", {}).ok());
  EXPECT_TRUE(client->query_stream("arena")->send({}).get().ok());
  EXPECT_TRUE(client->update_stream("arena")->send({}).get().ok());
  EXPECT_TRUE(client->upload_mesh({}).ok());
  EXPECT_FALSE(client->download_mesh("rock").ok());
  EXPECT_TRUE(client->dump({}, [](const v1::DumpSceneResponse&) { return absl::OkStatus(); }).ok());
  class Nowhere final : public BackupSink {
    absl::Status begin(const BackupSize&) override { return absl::OkStatus(); }
    absl::Status begin_file(const std::string&) override { return absl::OkStatus(); }
    absl::Status add(absl::string_view) override { return absl::OkStatus(); }
    absl::Status end_file(const BackupFile&) override { return absl::OkStatus(); }
  } nowhere;
  EXPECT_FALSE(client->backup(nowhere).ok());
  for (const char* method :
       {"GetServer", "Query", "StreamQueries", "StreamUpdates", "UploadMesh", "DownloadMesh", "DumpScene", "Backup"})
    EXPECT_EQ(server.authorization_of(method), "Bearer secret") << method;
}

TEST(AuthorizationTest, ACallCarriesTheTokenOverTls) {
  const test::TestAuthority authority("test authority");
  const test::TestCertificate own = authority.for_server();
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({own.key, own.certificate});
  const GuardedServer server(grpc::SslServerCredentials(options));
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("ca.pem")) << authority.certificate();
  const std::unique_ptr<Client> client = connected(server, {.ca_file = folder.file("ca.pem"), .token = "secret"});
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server.authorization_of("GetServer"), "Bearer secret");
}

TEST(AuthorizationTest, WithoutATokenNothingIsSent) {
  const GuardedServer server;
  const std::unique_ptr<Client> client = connected(server, {});
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server.authorization_of("GetServer"), "");
}

class TokenFileTest : public ::testing::Test {
 protected:
  void replace(const std::string& token) { test::replace_file(file_, token + "\n"); }

  const test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("token");
  GuardedServer server_;
};

TEST_F(TokenFileTest, AChangedFileIsReadBeforeTheNextCall) {
  replace("one");
  const std::unique_ptr<Client> client = connected(server_, {.token_file = file_});
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server_.authorization_of("GetServer"), "Bearer one");
  replace("two");
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server_.authorization_of("GetServer"), "Bearer two");
  ASSERT_EQ(std::remove(file_.c_str()), 0);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server_.authorization_of("GetServer"), "Bearer two") << "the old token stays";
}

TEST_F(TokenFileTest, ARefusedTokenEndsACallAfterOneAttempt) {
  replace("one");
  server_.require("two");
  const std::unique_ptr<Client> client = connected(server_, {.token_file = file_});
  ASSERT_NE(client, nullptr);
  const absl::Status refused = client->get_server().status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("give a valid token"));
  EXPECT_EQ(server_.calls(), 1);
}

TEST_F(TokenFileTest, ARefusedCallIsRepeatedWithTheTokenThatReplacedItsOwn) {
  replace("one");
  server_.require("two");
  server_.before_refusal([this] { replace("two"); });
  const std::unique_ptr<Client> client = connected(server_, {.token_file = file_});
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->get_server().ok());
  EXPECT_EQ(server_.calls(), 2);
}

TEST_F(TokenFileTest, AStreamContinuesWithTheNewTokenAfterTheOldOneIsRefused) {
  replace("one");
  server_.require("one");
  const std::unique_ptr<Client> client = connected(server_, {.token_file = file_});
  ASSERT_NE(client, nullptr);
  const std::unique_ptr<UpdateStream> stream = client->update_stream("arena");
  ASSERT_TRUE(stream->send({}).get().ok());
  replace("two");
  server_.require("two");
  EXPECT_TRUE(stream->send({}).get().ok());
  EXPECT_EQ(server_.authorization_of("StreamUpdates"), "Bearer two");
  server_.require("three");
  EXPECT_EQ(stream->send({}).get().status().code(), absl::StatusCode::kUnauthenticated) << "the file has no newer one";
}

TEST_F(TokenFileTest, ATokenIsNewerOnlyIfTheFileHasAnotherOne) {
  replace("one");
  const auto authorization = Authorization::make({.token_file = file_}, "127.0.0.1:80");
  ASSERT_TRUE(authorization.ok());
  EXPECT_FALSE((*authorization)->has_newer(1));
  replace("one");
  EXPECT_FALSE((*authorization)->has_newer(1));
  replace("two");
  EXPECT_TRUE((*authorization)->has_newer(1));
  EXPECT_FALSE((*authorization)->has_newer(2));
  replace("not a token");
  EXPECT_FALSE((*authorization)->has_newer(2));
}

}  // namespace
}  // namespace locus::client
