#include "server/observability/http_server.h"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>
#include <vector>

#include "server/config/observability_limits.h"
#include "tests/support/http_get.h"

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
    absl::StatusOr<std::unique_ptr<HttpServer>> started = HttpServer::start(
        *parse_listen_address("127.0.0.1:0"), {{"/page", [] { return HttpReply{.body = "text\n"}; }},
                                               {"/busy", [] { return HttpReply{.code = 503, .body = "later\n"}; }}});
    ASSERT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
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
  for (uint32_t i = 0; i < 2 * kHttpThreads; ++i)
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
  const auto server = HttpServer::start(*parse_listen_address("[::1]:0"), {});
  if (!server.ok()) GTEST_SKIP() << "this machine has no [::1]";
  EXPECT_GT((*server)->port(), 0);
}

}  // namespace
}  // namespace locus::server
