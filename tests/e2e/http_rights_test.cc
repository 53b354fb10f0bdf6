// The HTTP port with access control and TLS: who may read which page.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "server/security/token_file.h"
#include "tests/support/http_get.h"
#include "tests/support/raw_socket.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kGrants = R"(grant token:scraper metrics
grant token:reader read,update,admin *
grant token:ops meshes,backup,reflection
grant cert:prometheus metrics
)";

class HttpRightsTest : public ::testing::Test {
 protected:
  HttpRightsTest() {
    write("access", kGrants);
    for (const char* name : {"scraper", "reader", "ops"})
      tokens_[name] = *server::add_token(folder_.file("tokens"), name, 1'000'000, {}, "");
    tokens_["wrong"] = tokens_["scraper"].substr(0, tokens_["scraper"].size() - 1) + "!";
    tokens_["stranger"] = "locus_nobody_0123456789012345678901234567890123456789012";
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name + ".new")) << text;
    std::filesystem::permissions(folder_.file(name + ".new"),
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::filesystem::rename(folder_.file(name + ".new"), folder_.file(name));
  }
  void write_server(const TestAuthority& authority) const {
    const TestCertificate pair = authority.for_server();
    write("key", pair.key);
    write("crt", pair.certificate);
  }
  server::ServerConfig config() const {
    server::ServerConfig config = test_config();
    config.http_listen = "127.0.0.1:0";
    config.access_file = folder_.file("access");
    config.token_file = folder_.file("tokens");
    config.audit_file = folder_.file("audit");
    return config;
  }
  server::ServerConfig tls_config() {
    write_server(authority_);
    server::ServerConfig config = this->config();
    config.tls_cert = folder_.file("crt");
    config.tls_key = folder_.file("key");
    return config;
  }
  void start(const server::ServerConfig& config) { running_.emplace(config); }
  // Returns the value of a metric. `name` is the metric's name with its labels, as written in /metrics.
  double metric(const std::string& name, HttpReader reader) {
    reader.authorization = "Bearer " + tokens_["scraper"];
    const std::string page = "\n" + http_get(running_->server().http_port(), "/metrics", "GET", reader).body;
    const size_t line = page.find("\n" + name + " ");
    EXPECT_NE(line, std::string::npos) << name;
    return line == std::string::npos ? -1 : std::stod(page.substr(line + name.size() + 2));
  }
  std::string read(const std::string& name) const { return text_of(folder_.file(name)); }
  // Returns the HTTP status code for a page; 0 if the connection failed.
  long code(const std::string& page, const std::string& who, HttpReader reader = {}) {
    if (!who.empty()) reader.authorization = "Bearer " + tokens_[who];
    return http_get(running_->server().http_port(), page, "GET", reader).code;
  }
  HttpReader trusting(const TestAuthority& authority, const TestCertificate& own = {}) const {
    write("ca", authority.certificate());
    HttpReader reader{.ca_file = folder_.file("ca")};
    if (own.certificate.empty()) return reader;
    write("own.crt", own.certificate);
    write("own.key", own.key);
    reader.certificate_file = folder_.file("own.crt");
    reader.key_file = folder_.file("own.key");
    return reader;
  }

  const TestAuthority authority_{"authority"};
  const TestAuthority clients_{"clients"};
  const TemporaryFolder folder_;
  std::map<std::string, std::string> tokens_;
  std::optional<RunningServer> running_;
};

TEST_F(HttpRightsTest, MetricsNeedTheRightAndHealthPagesNeedNone) {
  start(config());
  const std::vector<std::pair<const char*, long>> rows = {{"", 401},       {"wrong", 401}, {"stranger", 401},
                                                          {"reader", 403}, {"ops", 403},   {"scraper", 200}};
  for (const auto& [who, expected] : rows) {
    EXPECT_EQ(code("/metrics", who), expected) << who;
    EXPECT_EQ(code("/healthz", who), 200) << who;
    EXPECT_EQ(code("/readyz", who), 200) << who;
  }
}

TEST_F(HttpRightsTest, WithoutAccessControlMetricsAreForEverybody) {
  server::ServerConfig open = test_config();
  open.http_listen = "127.0.0.1:0";
  start(open);
  EXPECT_EQ(code("/metrics", ""), 200);
  EXPECT_EQ(code("/metrics", "wrong"), 200);
}

TEST_F(HttpRightsTest, RefusalsSayNothingOfScenesAndAreAudited) {
  start(config());
  const int port = running_->server().http_port();
  const HttpAnswer none = http_get(port, "/metrics");
  EXPECT_THAT(none.body, Not(HasSubstr("locus_")));
  EXPECT_THAT(none.body, HasSubstr("right metrics"));
  EXPECT_THAT(none.headers, HasSubstr("WWW-Authenticate: Bearer"));
  EXPECT_THAT(http_get(port, "/metrics", "GET", {.authorization = "Bearer " + tokens_["ops"]}).body,
              HasSubstr("token:ops lacks the right metrics"));
  running_.reset();  // writes the queued lines
  const std::string audit = read("audit.refused");
  EXPECT_THAT(audit, HasSubstr(R"("principal":"anonymous","peer":"ipv4:127.0.0.1:)"));
  EXPECT_THAT(audit, HasSubstr(R"("rpc":"/metrics","subject":"","code":"PERMISSION_DENIED")"));
  for (const auto& [name, token] : tokens_) EXPECT_THAT(audit, Not(HasSubstr(token))) << name;
}

TEST_F(HttpRightsTest, GrantsAndTokensCountAnewAfterAReload) {
  start(config());
  EXPECT_EQ(code("/metrics", "scraper"), 200);
  ASSERT_TRUE(server::revoke_token(folder_.file("tokens"), "scraper").ok());
  write("access", std::string(kGrants) + "grant token:ops metrics\n");
  running_->server().reload();
  EXPECT_EQ(code("/metrics", "scraper"), 401);
  EXPECT_EQ(code("/metrics", "ops"), 200);
}

TEST_F(HttpRightsTest, WithACertificateTheDaemonServesItsPagesOverTlsAndReloadsIt) {
  start(tls_config());
  const HttpReader reader = trusting(authority_);
  EXPECT_EQ(code("/healthz", ""), 0) << "without TLS";
  EXPECT_EQ(code("/healthz", "", reader), 200);
  EXPECT_EQ(code("/metrics", "", reader), 401);
  EXPECT_EQ(code("/metrics", "scraper", reader), 200);
  const TestAuthority next("next");
  write_server(next);
  running_->server().reload();
  EXPECT_EQ(code("/metrics", "scraper", trusting(authority_)), 0);
  EXPECT_EQ(code("/metrics", "scraper", trusting(next)), 200);
}

TEST_F(HttpRightsTest, AnAccessFileThatCannotBeUsedIsCountedUntilItIsMendedAndTheOldRulesStay) {
  start(config());
  EXPECT_GT(metric(R"(locus_files_loaded_time_seconds{files="access"})", {}), 0);
  EXPECT_EQ(metric(R"(locus_files_loaded_time_seconds{files="tls"})", {}), 0) << "there are no such files";
  write("access", "grant token:scraper\n");
  running_->server().reload();
  EXPECT_EQ(metric(R"(locus_files_refused{files="access"})", {}), 1);
  EXPECT_GE(metric(R"(locus_file_reload_failures_total{files="access"})", {}), 1);
  write("access", kGrants);
  running_->server().reload();
  EXPECT_EQ(metric(R"(locus_files_refused{files="access"})", {}), 0);
  EXPECT_GE(metric(R"(locus_file_reloads_total{files="access"})", {}), 1);
  EXPECT_EQ(metric(R"(locus_files_refused{files="tls"})", {}), 0);
  running_.reset();  // writes the queued lines
  EXPECT_THAT(read("audit"), HasSubstr(R"("rpc":"reload","subject":"access files","code":"OK")"));
  EXPECT_THAT(read("audit.refused"), HasSubstr(R"("rpc":"reload","subject":"access files","code":"INVALID_ARGUMENT")"));
}

TEST_F(HttpRightsTest, TheDeletionOfAnIdleSceneIsCountedAndAudited) {
  start(config());
  EXPECT_EQ(metric("locus_scenes_expired_total", {}), 0);
  EXPECT_EQ(metric("locus_meshes_collected_total", {}), 0);
  EXPECT_EQ(metric("locus_leases_ended_total", {}), 0);
  grpc::ClientContext context;
  set_timeout(context);
  context.AddMetadata("authorization", "Bearer " + tokens_["reader"]);
  v1::CreateSceneRequest request;
  request.set_name("arena");
  request.mutable_spec()->set_idle_ttl_s(1);
  v1::CreateSceneResponse created;
  ASSERT_TRUE(running_->stubs().scenes->CreateScene(&context, request, &created).ok());
  EXPECT_TRUE(wait_until([&] { return metric("locus_scenes_expired_total", {}) == 1; }));
  running_.reset();  // writes the queued lines
  EXPECT_THAT(read("audit"), HasSubstr(R"("rpc":"DeleteScene","subject":"arena","code":"OK")"));
}

TEST_F(HttpRightsTest, ACertificateThatCannotBeUsedIsCountedUntilItIsMendedAndTheOldOneStays) {
  start(tls_config());
  const HttpReader reader = trusting(authority_);
  EXPECT_GT(metric(R"(locus_files_loaded_time_seconds{files="tls"})", reader), 0);
  const std::string good = read("crt");
  write("crt", "nonsense");
  EXPECT_TRUE(wait_until([&] { return metric(R"(locus_files_refused{files="tls"})", reader) == 1; }));
  EXPECT_EQ(metric(R"(locus_file_reload_failures_total{files="tls"})", reader), 1);
  write("crt", good);
  EXPECT_TRUE(wait_until([&] { return metric(R"(locus_files_refused{files="tls"})", reader) == 0; }));
  running_.reset();
  EXPECT_THAT(read("audit.refused"), HasSubstr(R"("rpc":"reload","subject":"TLS files","code":"INVALID_ARGUMENT")"));
}

TEST_F(HttpRightsTest, WithAClientCaACertificateIsNeededAndNamesItsReader) {
  server::ServerConfig config = tls_config();
  write("clients", clients_.certificate());
  config.tls_client_ca = folder_.file("clients");
  start(config);
  EXPECT_EQ(code("/healthz", "scraper", trusting(authority_)), 0);
  const TestCertificate game = clients_.issue({.common_name = "game"});
  EXPECT_EQ(code("/healthz", "", trusting(authority_, game)), 200);
  EXPECT_EQ(code("/metrics", "", trusting(authority_, game)), 403);
  EXPECT_EQ(code("/metrics", "scraper", trusting(authority_, game)), 200);
  const TestCertificate prometheus = clients_.issue({.common_name = "prometheus"});
  EXPECT_EQ(code("/metrics", "", trusting(authority_, prometheus)), 200);
}

}  // namespace
}  // namespace locus::test
