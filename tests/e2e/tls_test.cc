#include <gmock/gmock.h>
#include <openssl/ssl.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/connections/frame_check.h"
#include "server/rpc/tls_credentials.h"
#include "server/rpc/tls_reads.h"
#include "server/scheduling/clocks.h"
#include "server/security/token_file.h"
#include "tests/support/raw_socket.h"
#include "tests/support/running_server.h"
#include "tests/support/signing_key.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"
#include "tests/support/text_of.h"

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

TEST_F(TlsTest, FailedHandshakesAreCountedAndAudited) {
  server::ServerConfig audited = config(true);
  audited.audit_file = folder_.file("audit");
  RunningServer running(audited);
  const uint64_t before = server::tls_counts().failed_handshakes;
  const TestCertificate foreign = authority_.issue({.common_name = "game"});
  const auto stranger = channel_to(running.address(), authority_.certificate(), foreign);
  EXPECT_FALSE(get_server(stranger, std::chrono::seconds(2)).ok());
  EXPECT_GT(server::tls_counts().failed_handshakes, before);
  EXPECT_TRUE(wait_until([&] {
    return text_of(folder_.file("audit.refused")).find(R"("rpc":"connect","subject":"","code":"UNAUTHENTICATED")") !=
           std::string::npos;
  }));
}

// A TLS connection of a client that offers one ALPN protocol and sends arbitrary bytes.
class RawTlsSocket {
 public:
  RawTlsSocket(int port, const std::string& protocol) : socket_(port) {
    std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to sockets that the server has closed
    const std::string offer = static_cast<char>(protocol.size()) + protocol;
    EXPECT_EQ(SSL_set_alpn_protos(ssl_.get(), reinterpret_cast<const unsigned char*>(offer.data()),
                                  static_cast<unsigned>(offer.size())),
              0);
    EXPECT_EQ(SSL_set_fd(ssl_.get(), socket_.descriptor()), 1);
    EXPECT_EQ(SSL_connect(ssl_.get()), 1);
  }
  bool send(const std::string& bytes) {
    return SSL_write(ssl_.get(), bytes.data(), static_cast<int>(bytes.size())) == static_cast<int>(bytes.size());
  }
  // Returns true until the server closes the connection.
  bool is_open() const {
    pollfd end{socket_.descriptor(), POLLRDHUP, 0};
    return poll(&end, 1, 0) == 0;
  }

 private:
  RawSocket socket_;
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context_{SSL_CTX_new(TLS_client_method()), &SSL_CTX_free};
  const std::unique_ptr<SSL, decltype(&SSL_free)> ssl_{SSL_new(context_.get()), &SSL_free};
};

// The test uses both ALPN names under which gRPC accepts HTTP/2.
TEST_F(TlsTest, ABlockOfHeadersThatIsTooLongClosesItsConnection) {
  RunningServer running(config(false));
  constexpr uint8_t kHeaders = 1, kContinuation = 9;
  const std::string field("\0\1n\1v", 5);
  std::string frames = kHttp2Opening + http2_frame(kHeaders, 0, 1, field);
  for (uint32_t frame = 0; frame < server::FrameCheck::kMaxContinuations; ++frame)
    frames += http2_frame(kContinuation, 0, 1, field);
  for (const char* protocol : {"h2", "grpc-exp"}) {
    RawTlsSocket honest(running.server().port(), protocol), attacker(running.server().port(), protocol);
    EXPECT_TRUE(honest.send(frames));
    EXPECT_TRUE(attacker.send(frames));
    EXPECT_TRUE(attacker.send(http2_frame(kContinuation, 0, 1, field)));
    EXPECT_TRUE(wait_until([&] { return !attacker.is_open(); }));
    EXPECT_TRUE(honest.is_open()) << protocol << ": the older connection, which is as silent, must still be open";
  }
  EXPECT_TRUE(get_server(channel_to(running.address(), authority_.certificate())).ok());
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
    running.server().reload_tls();  // returns false if the server has just reloaded the file by itself
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

// Fixture whose clients call without a pause while every file of TLS and access control is replaced. The clients send
// tokens or JWTs, some on a kept connection and some on new connections.
class TlsReloadTest : public TlsTest {
 protected:
  // If `mutual` is true, the server requires client certificates, and the file of the clients' authorities changes too.
  explicit TlsReloadTest(bool mutual = false) : mutual_(mutual) {
    change_access(0);
    change_keys();
    token_ = *server::add_token(tokens(), "caller", kForever, {}, "");
    if (mutual) own_ = clients_.issue({.common_name = "game"});
    server::ServerConfig with_tokens = config(mutual);
    with_tokens.jwks_file = folder_.file("jwks");
    with_tokens.jwt_audience = "locus";
    with_tokens.access_file = folder_.file("access");
    with_tokens.token_file = tokens();
    running_.emplace(with_tokens);
  }
  ~TlsReloadTest() override {
    end_.store(true);
    for (std::thread& thread : clients_of_test_) thread.join();
  }

  std::string tokens() const { return folder_.file("tokens"); }
  std::shared_ptr<grpc::Channel> channel() { return channel_to(running_->address(), authority_.certificate(), own_); }
  static void set_token(grpc::ClientContext& context, const std::string& token) {
    set_timeout(context);
    context.AddMetadata("authorization", "Bearer " + token);
  }
  void call(const std::shared_ptr<grpc::Channel>& channel, const std::string& token) {
    grpc::ClientContext context;
    set_token(context, token);
    v1::GetServerResponse response;
    const grpc::Status status = v1::ServerService::NewStub(channel)->GetServer(&context, {}, &response);
    calls_.fetch_add(1);
    if (!status.ok() && failed_.fetch_add(1) < 5) ADD_FAILURE() << status.error_message();
  }
  void start_clients() {
    clients_of_test_.emplace_back([this, kept = channel()] {
      while (!end_.load()) call(kept, token_);
    });
    clients_of_test_.emplace_back([this] {
      while (!end_.load()) call(channel(), token_);
    });
    const std::string claims =
        absl::StrCat(R"({"sub":"caller","aud":"locus","exp":)", server::unix_seconds() + kForever, "}");
    clients_of_test_.emplace_back([this, kept = channel(), jwt = key_.jwt(R"({"alg":"EdDSA","kid":"kept"})", claims)] {
      while (!end_.load()) call(kept, jwt);
    });
  }

  // Replaces the access file by one with the same grants.
  void change_access(int number) const {
    replace_file(folder_.file("access"), absl::StrCat("# change ", number,
                                                      "\ngrant token:caller admin *\ngrant token:guest read *\n"
                                                      "grant jwt:caller read *\n"));
  }
  // Replaces the file of keys for JWTs. The key that is in use stays in the file; the other key changes.
  void change_keys() const {
    replace_file(folder_.file("jwks"), absl::StrCat(R"({"keys":[)", key_.jwk(R"(,"kid":"kept")"), ",",
                                                    SigningKey::ed25519().jwk(R"(,"kid":"other")"), "]}"));
  }
  // Changes the order of the clients' authorities, and now and then adds one. A removal would end connections.
  void change_authorities(int number) {
    if (number % 50 == 0) authorities_.push_back(TestAuthority(absl::StrCat("authority ", number)).certificate());
    std::rotate(authorities_.begin(), authorities_.begin() + 1, authorities_.end());
    std::string all;
    for (const std::string& authority : authorities_) all += authority;
    replace_file(folder_.file("ca"), all);
  }

  // Gives a guest a token, lets it open a stream, revokes the token, and waits until the stream has ended. Returns the
  // time from the revocation to the end.
  std::chrono::nanoseconds revoke_one(const std::shared_ptr<grpc::Channel>& channel) {
    const absl::StatusOr<std::string> token = server::add_token(tokens(), "guest", kForever, {}, "");
    EXPECT_TRUE(token.ok()) << token.status();
    running_->server().reload();
    grpc::ClientContext context;
    set_token(context, *token);
    const auto stream = v1::QueryService::NewStub(channel)->StreamQueries(&context);
    v1::StreamQueriesRequest request;
    request.set_scene("world");
    v1::StreamQueriesResponse response;
    EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_TRUE(server::revoke_token(tokens(), "guest").ok());
    EXPECT_FALSE(stream->Read(&response));  // returns when the stream ends
    const auto end = std::chrono::steady_clock::now();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
    return end - begin;
  }

  // Repeats these steps `times` times: replaces the certificate and the other files, adds a token, and revokes it.
  void reload(int times) {
    create_world();
    start_clients();
    const std::shared_ptr<grpc::Channel> guests = channel();
    std::chrono::nanoseconds longest{0};
    for (int i = 0; i < times && !HasFailure(); ++i) {
      write(authority_.for_server("server " + std::to_string(i)));
      change_access(i);
      change_keys();
      if (mutual_) change_authorities(i);
      longest = std::max(longest, revoke_one(guests));
    }
    std::cout << "proof: " << times << " changes of certificates, " << (mutual_ ? "authorities, " : "")
              << "access file, keys and tokens: " << calls_.load() << " calls, " << failed_.load()
              << " failed; streams of revoked tokens ended within "
              << std::chrono::ceil<std::chrono::milliseconds>(longest).count() << " ms" << std::endl;
    EXPECT_EQ(failed_.load(), 0);
    EXPECT_GT(calls_.load(), times);
  }

 private:
  static constexpr int64_t kForever = 1'000'000;

  void create_world() {
    grpc::ClientContext context;
    set_token(context, token_);
    v1::CreateSceneRequest request;
    request.set_name("world");
    v1::CreateSceneResponse response;
    ASSERT_TRUE(v1::SceneService::NewStub(channel())->CreateScene(&context, request, &response).ok());
  }

  const bool mutual_;
  const SigningKey key_ = SigningKey::ed25519();
  TestCertificate own_;
  std::vector<std::string> authorities_ = {clients_.certificate()};
  std::string token_;
  std::optional<RunningServer> running_;
  std::atomic<bool> end_{false};
  std::atomic<int> calls_{0};
  std::atomic<int> failed_{0};
  std::vector<std::thread> clients_of_test_;
};

TEST_F(TlsReloadTest, FiftyChangesDropNoCallAndEndTheStreamsOfRevokedTokens) { reload(50); }

// TlsReloadTest with client certificates.
class MutualTlsReloadTest : public TlsReloadTest {
 protected:
  MutualTlsReloadTest() : TlsReloadTest(true) {}
};
TEST_F(MutualTlsReloadTest, FiftyChangesDropNoCallAndEndTheStreamsOfRevokedTokens) { reload(50); }

using LongTlsReloadTest = TlsReloadTest;
TEST_F(LongTlsReloadTest, AThousandChangesDropNoCallAndEndTheStreamsOfRevokedTokens) { reload(1000); }
using LongMutualTlsReloadTest = MutualTlsReloadTest;
TEST_F(LongMutualTlsReloadTest, AThousandChangesDropNoCallAndEndTheStreamsOfRevokedTokens) { reload(1000); }

}  // namespace
}  // namespace locus::test
