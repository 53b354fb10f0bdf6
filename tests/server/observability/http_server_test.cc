#include "server/observability/http_server.h"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "server/config/observability_limits.h"
#include "tests/support/http_get.h"
#include "tests/support/machine_features.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::server {
namespace {

using test::http_get;
using test::HttpAnswer;
using test::RawConnection;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class HttpServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<HttpServer>> started =
        HttpServer::start(*parse_listen_address("127.0.0.1:0"),
                          {{"/page", [](const HttpRequest&) { return HttpReply{.body = "text\n"}; }},
                           {"/who", [](const HttpRequest& reader) { return HttpReply{.body = who(reader)}; }},
                           {"/stop", [](const HttpRequest&) { return HttpReply{.code = 401, .body = ""}; }},
                           {"/busy", [](const HttpRequest&) { return HttpReply{.code = 503, .body = "later\n"}; }}});
    ASSERT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
  }

  static std::string who(const HttpRequest& reader) {
    return reader.peer + " " + reader.address + " " + reader.authorization;
  }
  int port() const { return server_->port(); }

  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, APageIsAnsweredWithItsCodeTypeAndText) {
  const HttpAnswer page = http_get(port(), "/page");
  EXPECT_EQ(page.code, 200);
  EXPECT_EQ(page.body, "text\n");
  EXPECT_THAT(page.headers, HasSubstr("Content-Type: text/plain"));
  EXPECT_THAT(page.headers, HasSubstr("Content-Length: 5"));
  const HttpAnswer busy = http_get(port(), "/busy");
  EXPECT_EQ(busy.code, 503);
  EXPECT_EQ(busy.body, "later\n");
}

TEST_F(HttpServerTest, HeadGivesTheHeadersOnly) {
  const HttpAnswer page = http_get(port(), "/page", "HEAD");
  EXPECT_EQ(page.code, 200);
  EXPECT_THAT(page.headers, HasSubstr("Content-Length: 5"));
  EXPECT_EQ(page.body, "");
}

TEST_F(HttpServerTest, APageKnowsItsReader) {
  const std::string body = http_get(port(), "/who", "GET", {.authorization = "Bearer secret"}).body;
  EXPECT_THAT(body, StartsWith("ipv4:127.0.0.1:"));
  EXPECT_THAT(body, HasSubstr(" 127.0.0.1 Bearer secret"));
  EXPECT_EQ(http_get(port(), "/page?query").code, 200);
  EXPECT_THAT(http_get(port(), "/stop").headers, HasSubstr("WWW-Authenticate: Bearer"));
}

TEST_F(HttpServerTest, OtherMethodsAreRefusedAndTheAllowedOnesListed) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    const HttpAnswer answer = http_get(port(), "/page", method);
    EXPECT_EQ(answer.code, 405) << method;
    EXPECT_THAT(answer.headers, HasSubstr("Allow: GET, HEAD")) << method;
  }
}

TEST_F(HttpServerTest, OtherPathsAreNotFoundAndThePagesListed) {
  for (const char* path : {"/", "/pag", "/page/", "/../etc/passwd"})
    EXPECT_EQ(http_get(port(), path).code, 404) << path;
  EXPECT_THAT(http_get(port(), "/nowhere").body, HasSubstr("/page\n"));
}

TEST_F(HttpServerTest, ARequestThatIsTooLongIsRefused) {
  const std::string line =
      "GET /page HTTP/1.1\r\nHost: here\r\nX: " + std::string(kMaxHttpRequestBytes, 'x') + "\r\n\r\n";
  const std::string answer = RawConnection(port(), line).read_all();
  EXPECT_THAT(answer, ::testing::Not(HasSubstr("200 OK")));
  EXPECT_EQ(http_get(port(), "/page").code, 200);
}

TEST_F(HttpServerTest, BytesThatAreNoRequestAreRefused) {
  EXPECT_THAT(RawConnection(port(), "\x16\x03\x01 hello\r\n\r\n").read_all(), HasSubstr("400"));
  EXPECT_EQ(http_get(port(), "/page").code, 200);
}

TEST_F(HttpServerTest, SilentConnectionsDoNotBlockOthers) {
  std::vector<std::unique_ptr<RawConnection>> silent;
  for (uint32_t i = 0; i < kMaxHttpConnections - 1; ++i)
    silent.push_back(std::make_unique<RawConnection>(port(), i % 2 == 0 ? "" : "GET /pa"));
  EXPECT_EQ(http_get(port(), "/page").code, 200);
}

TEST_F(HttpServerTest, ManyConcurrentRequestsAreAllAnswered) {
  std::atomic<int> answered{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([this, &answered] {
      for (int j = 0; j < 20; ++j) answered += http_get(port(), "/page").code == 200 ? 1 : 0;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(answered, 160);
}

TEST_F(HttpServerTest, APortInUseIsAnError) {
  const ListenAddress address = *parse_listen_address("127.0.0.1:" + std::to_string(port()));
  const auto second = HttpServer::start(address, {});
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(HttpServerTest, AnIpv6AddressIsListenedOn) {
  if (!test::has_ipv6()) GTEST_SKIP() << "this machine has no [::1]";
  const auto server = HttpServer::start(*parse_listen_address("[::1]:0"), {});
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_GT((*server)->port(), 0);
}

// The HTTP port over TLS, with certificates that a test replaces.
class HttpTlsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    use(authority_, "");
    absl::StatusOr<std::unique_ptr<HttpServer>> started = HttpServer::start(
        *parse_listen_address("127.0.0.1:0"),
        {{"/name", [](const HttpRequest& reader) { return HttpReply{.body = reader.certificate_name}; }}}, [this] {
          const MutexLock lock(mutex_);
          return contents_;
        });
    ASSERT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
  }

  void use(const test::TestAuthority& authority, const std::string& client_ca) {
    const test::TestCertificate pair = authority.for_server();
    const MutexLock lock(mutex_);
    contents_ = {pair.certificate, pair.key, client_ca};
  }
  HttpAnswer get(const test::TestAuthority& trusted, const test::TestCertificate& own = {}) const {
    test::HttpReader reader{.ca_file = folder_.file("ca")};
    test::replace_file(reader.ca_file, trusted.certificate());
    if (!own.certificate.empty()) {
      reader.certificate_file = folder_.file("crt");
      reader.key_file = folder_.file("key");
      test::replace_file(reader.certificate_file, own.certificate);
      test::replace_file(reader.key_file, own.key);
    }
    return http_get(server_->port(), "/name", "GET", reader);
  }

  const test::TestAuthority authority_{"authority"};
  const test::TestAuthority clients_{"clients"};
  const test::TemporaryFolder folder_;
  Mutex mutex_;
  TlsContents contents_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpTlsTest, OnlyTlsIsServed) {
  EXPECT_EQ(get(authority_).code, 200);
  EXPECT_EQ(http_get(server_->port(), "/name").code, 0) << "without TLS";
  EXPECT_EQ(get(test::TestAuthority("other")).code, 0);
  EXPECT_EQ(RawConnection(server_->port(), "GET /name HTTP/1.1\r\n\r\n").read_all().find("200"), std::string::npos);
}

TEST_F(HttpTlsTest, NewConnectionsUseNewCertificates) {
  const test::TestAuthority next("next");
  use(next, "");
  EXPECT_EQ(get(authority_).code, 0);
  EXPECT_EQ(get(next).code, 200);
}

TEST_F(HttpTlsTest, AClientCaDemandsACertificateAndItsNameIsKnown) {
  use(authority_, clients_.certificate());
  EXPECT_EQ(get(authority_).code, 0);
  EXPECT_EQ(get(authority_, authority_.issue({.common_name = "game"})).code, 0) << "of another authority";
  EXPECT_EQ(get(authority_, clients_.issue({.common_name = "game", .valid_to_s = -60})).code, 0) << "expired";
  EXPECT_EQ(get(authority_, clients_.issue({.common_name = "game"})).body, "game");
  const std::string names = "DNS:other.example,URI:spiffe://game/scraper";
  EXPECT_EQ(get(authority_, clients_.issue({.common_name = "game", .alternative_names = names})).body,
            "spiffe://game/scraper");
  EXPECT_EQ(get(authority_, clients_.issue({.common_name = "game", .alternative_names = "DNS:a.example"})).body,
            "a.example");
}

}  // namespace
}  // namespace locus::server
