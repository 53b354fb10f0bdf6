// Fixture with a server that has access control: an access file, tokens and an audit log.
#ifndef LOCUS_TESTS_SUPPORT_ACCESS_FIXTURE_H_
#define LOCUS_TESTS_SUPPORT_ACCESS_FIXTURE_H_

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>

#include "server/security/token_file.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {

inline constexpr std::array kNames = {"reader", "updater", "admin", "ops", "elsewhere"};
inline constexpr const char* kAccess = R"(# who may do what
grant token:reader read arena-*
grant token:updater update arena-*
grant token:admin admin *
grant token:ops meshes,backup,metrics,reflection
grant token:elsewhere admin lobby-*
)";

class AccessRpcTest : public ::testing::Test {
 protected:
  AccessRpcTest() {
    write("access", kAccess);
    for (const char* name : kNames) tokens_[name] = *server::add_token(folder_.file("tokens"), name, 1'000'000, {}, "");
    running_.emplace(config());
    create("arena-1");
  }

  void write(const std::string& name, const std::string& text) const {
    const std::string fresh = folder_.file(name) + ".new";
    std::ofstream(fresh) << text;
    std::filesystem::permissions(fresh, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::filesystem::rename(fresh, folder_.file(name));
  }
  std::string read(const std::string& name) const { return text_of(folder_.file(name)); }
  server::ServerConfig config() const {
    server::ServerConfig config = test_config();
    config.access_file = folder_.file("access");
    config.token_file = folder_.file("tokens");
    config.audit_file = folder_.file("audit");
    config.log_level = server::LogLevel::kError;
    return config;
  }

  RawReply call(const std::string& path, const std::string& who, const std::string& scene = "arena-1",
                std::chrono::milliseconds timeout = kCallTimeout) {
    const std::string bytes = std::string("\x0a") + static_cast<char>(scene.size()) + scene;
    return raw_call(running_->stubs().channel, path, bytes, timeout, who.empty() ? "" : tokens_[who]);
  }
  // Waits until `count` calls are in progress.
  void wait_for_calls(double count) {
    v1::GetServerResponse server;
    double used = 0;
    while (used < count + 1) {  // GetServer counts its own call, too
      ASSERT_TRUE(server.ParseFromString(call("/locus.v1.ServerService/GetServer", "admin", "").bytes));
      for (const v1::Limit& limit : server.limits())
        if (limit.name() == "calls") used = limit.used();
    }
  }
  void create(const std::string& scene) {
    const grpc::Status status = call("/locus.v1.SceneService/CreateScene", "admin", scene).status;
    EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::ALREADY_EXISTS) << status.error_message();
  }

  const TemporaryFolder folder_;
  std::map<std::string, std::string> tokens_;
  std::optional<RunningServer> running_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ACCESS_FIXTURE_H_
