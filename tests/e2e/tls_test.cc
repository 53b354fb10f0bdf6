#include <gmock/gmock.h>

#include <atomic>
#include <functional>
#include <thread>

#include "server/rpc/tls_credentials.h"
#include "tests/support/raw_socket.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

// A server with TLS and the files that it reads.
class TlsTest : public ::testing::Test {
 protected:
  TlsTest() { write(authority_.for_server("first")); }

  void write(const TestCertificate& pair) const {
    replace_file(folder_.file("key"), pair.key);
    replace_file(folder_.file("crt"), pair.certificate);
  }
  server::ServerConfig config(bool with_clients) const {
    server::ServerConfig config = test_config();
    config.max_new_connections = 100'000;
    config.max_connections_per_address = 100'000;
    config.tls_cert = folder_.file("crt");
    config.tls_key = folder_.file("key");
    if (with_clients) {
      replace_file(folder_.file("ca"), clients_.certificate());
      config.tls_client_ca = folder_.file("ca");
    }
    return config;
  }

  static std::shared_ptr<grpc::Channel> channel_to(const std::string& address, const std::string& root,
                                                   const TestCertificate& own = {}) {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = root;
    options.pem_cert_chain = own.certificate;
    options.pem_private_key = own.key;
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(address, grpc::SslCredentials(options), arguments);
  }
  static grpc::Status get_server(const std::shared_ptr<grpc::Channel>& channel,
                                 std::chrono::milliseconds timeout = kCallTimeout) {
    grpc::ClientContext context;
    set_timeout(context, timeout);
    v1::GetServerResponse response;
    return v1::ServerService::NewStub(channel)->GetServer(&context, {}, &response);
  }

  const TestAuthority authority_{"authority"};
  const TestAuthority clients_{"clients"};
  const TemporaryFolder folder_;
};

TEST_F(TlsTest, AClientThatTrustsTheAuthorityIsServedAndOthersAreNot) {
  RunningServer running(config(false));
  EXPECT_TRUE(get_server(channel_to(running.address(), authority_.certificate())).ok());
  EXPECT_FALSE(get_server(channel_to(running.address(), TestAuthority("other").certificate())).ok());
  EXPECT_FALSE(get_server(running.stubs().channel, std::chrono::seconds(2)).ok()) << "without TLS";
}

TEST_F(TlsTest, OnlyClientsWithACertificateOfTheClientCaAreServed) {
  RunningServer running(config(true));
  const std::string root = authority_.certificate();
  const TestCertificate own = clients_.issue({.common_name = "game"});
  EXPECT_TRUE(get_server(channel_to(running.address(), root, own)).ok());
  EXPECT_FALSE(get_server(channel_to(running.address(), root), std::chrono::seconds(2)).ok());
  const TestCertificate foreign = authority_.issue({.common_name = "game"});
  EXPECT_FALSE(get_server(channel_to(running.address(), root, foreign), std::chrono::seconds(2)).ok());
  const TestCertificate expired = clients_.issue({.common_name = "game", .valid_from_s = -7200, .valid_to_s = -3600});
  EXPECT_FALSE(get_server(channel_to(running.address(), root, expired), std::chrono::seconds(2)).ok());
}

TEST_F(TlsTest, BadFilesAreRefusedAtTheStartWithTheirNames) {
  server::ServerConfig bad = config(false);
  bad.tls_key = bad.tls_cert;
  EXPECT_THAT(std::string(server::Server::start(bad).status().message()), HasSubstr("has no private key"));
  bad.tls_key = folder_.file("gone");
  EXPECT_THAT(std::string(server::Server::start(bad).status().message()), HasSubstr(folder_.file("gone")));
}

TEST_F(TlsTest, NewConnectionsUseAChangedCertificateAndOldOnesStay) {
  RunningServer running(config(false));
  const std::string root = authority_.certificate();
  const auto old = channel_to(running.address(), root);
  ASSERT_TRUE(get_server(old).ok());
  const TestAuthority next("next");
  write(next.for_server());
  EXPECT_TRUE(wait_until(
      [&] { return get_server(channel_to(running.address(), next.certificate()), std::chrono::seconds(2)).ok(); }));
  EXPECT_TRUE(get_server(old).ok());
  EXPECT_FALSE(get_server(channel_to(running.address(), root), std::chrono::seconds(2)).ok());
}

// Opens a stream and returns the status with which the server ends it.
grpc::Status end_of_stream(const std::shared_ptr<grpc::Channel>& channel, const std::function<void()>& once_open) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = v1::QueryService::NewStub(channel)->StreamQueries(&context);
  once_open();
  v1::StreamQueriesResponse response;
  EXPECT_FALSE(stream->Read(&response));
  return stream->Finish();
}

TEST_F(TlsTest, AConnectionEndsWhenItsCertificateExpires) {
  RunningServer running(config(true));
  const TestCertificate own = clients_.issue({.common_name = "game", .valid_to_s = 12});
  const auto channel = channel_to(running.address(), authority_.certificate(), own);
  ASSERT_TRUE(get_server(channel).ok());
  EXPECT_EQ(end_of_stream(channel, [] {}).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(TlsTest, ConnectionsEndWhenAClientCaIsRemoved) {
  RunningServer running(config(true));
  const TestAuthority next("next");
  const auto channel = channel_to(running.address(), authority_.certificate(), clients_.issue({.common_name = "game"}));
  ASSERT_TRUE(get_server(channel).ok());
  const grpc::Status ended = end_of_stream(channel, [&] {
    replace_file(folder_.file("ca"), next.certificate());
    running.server().reload_tls();  // false if the server has just read it by itself
  });
  EXPECT_EQ(ended.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(get_server(channel, std::chrono::seconds(2)).ok());
  const TestCertificate own = next.issue({.common_name = "game"});
  EXPECT_TRUE(get_server(channel_to(running.address(), authority_.certificate(), own)).ok());
}

TEST_F(TlsTest, OnlyTheRemovalOfAnAuthorityIsReported) {
  replace_file(folder_.file("ca"), clients_.certificate());
  std::atomic<int> removed{0};
  server::TlsHooks hooks;
  hooks.authority_removed = [&] { ++removed; };
  const server::TlsFiles files{folder_.file("crt"), folder_.file("key"), folder_.file("ca")};
  auto credentials = server::TlsCredentials::start(files, hooks);
  ASSERT_TRUE(credentials.ok()) << credentials.status();
  const TestAuthority next("next");
  replace_file(folder_.file("ca"), next.certificate() + clients_.certificate());
  EXPECT_TRUE(wait_until([&] { return (*credentials)->reloads() == 1; }));
  write(authority_.for_server("second"));
  EXPECT_TRUE(wait_until([&] { return (*credentials)->reloads() >= 2; }));
  EXPECT_EQ(removed.load(), 0);
  replace_file(folder_.file("ca"), next.certificate());
  EXPECT_TRUE(wait_until([&] { return removed.load() == 1; }));
}

TEST_F(TlsTest, AFileThatCannotBeUsedLeavesTheOldOneInUseAndIsCounted) {
  const server::TlsFiles files{folder_.file("crt"), folder_.file("key"), ""};
  auto credentials = server::TlsCredentials::start(files);
  ASSERT_TRUE(credentials.ok()) << credentials.status();
  replace_file(folder_.file("key"), "nonsense");
  EXPECT_TRUE(wait_until([&] { return (*credentials)->failures() == 1; }));
  EXPECT_EQ((*credentials)->reloads(), 0u);
  write(authority_.for_server("second"));
  EXPECT_TRUE(wait_until([&] { return (*credentials)->reloads() == 1; }));
  EXPECT_EQ((*credentials)->failures(), 1u);
}

TEST_F(TlsTest, AServerWithABadNewFileServesNewConnections) {
  RunningServer running(config(false));
  replace_file(folder_.file("crt"), "nonsense");
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(get_server(channel_to(running.address(), authority_.certificate())).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// Runs clients on old and new connections while the files are replaced.
class TlsReloadTest : public TlsTest {
 protected:
  void reload(int times) {
    RunningServer running(config(false));
    std::atomic<bool> end{false};
    std::atomic<int> calls{0};
    std::atomic<int> failed{0};
    const auto count = [&](const grpc::Status& status) {
      ++calls;
      if (!status.ok() && ++failed < 5) ADD_FAILURE() << status.error_message();
    };
    std::thread steady([&] {
      const auto channel = channel_to(running.address(), authority_.certificate());
      while (!end.load()) count(get_server(channel));
    });
    std::thread opening([&] {
      while (!end.load()) count(get_server(channel_to(running.address(), authority_.certificate())));
    });
    for (int i = 0; i < times; ++i) {
      write(authority_.for_server("server " + std::to_string(i)));
      running.server().reload_tls();  // false if the server has just read them by itself
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    end.store(true);
    steady.join();
    opening.join();
    EXPECT_EQ(failed.load(), 0);
    EXPECT_GT(calls.load(), times);
  }
};

TEST_F(TlsReloadTest, AHundredChangesOfTheFilesDropNoCall) { reload(100); }

using LongTlsReloadTest = TlsReloadTest;
TEST_F(LongTlsReloadTest, AThousandChangesOfTheFilesDropNoCall) { reload(1000); }

}  // namespace
}  // namespace locus::test
