#include "client/cli/connection_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/security/context_writer.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

class ConnectionOptionsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    contexts_.default_name = "usual";
    contexts_.by_name["usual"] = {"usual:1", "", "/usual.pem", "", "", "", "/usual.token"};
    contexts_.by_name["prod"] = {"prod:1", "true", "", "/prod.pem", "/prod.key", "inner", "/prod.token"};
    ASSERT_TRUE(write_contexts(path_, contexts_).ok());
    for (const char* name : kVariables) unsetenv(name);
  }
  void TearDown() override {
    for (const char* name : kVariables) unsetenv(name);
  }

  absl::Status parse(std::vector<std::string> line, ConnectionOptions& options) {
    CLI::App app;
    add_connection_options(app, options);
    std::reverse(line.begin(), line.end());
    app.parse(std::move(line));
    return complete_from_context(app, path_, options);
  }
  ConnectionOptions parsed(const std::vector<std::string>& line) {
    ConnectionOptions options;
    EXPECT_TRUE(parse(line, options).ok());
    return options;
  }

  static constexpr const char* kVariables[] = {"LOCUS_ADDRESS",     "LOCUS_CONTEXT",   "LOCUS_TLS",
                                               "LOCUS_CA",          "LOCUS_CERT",      "LOCUS_KEY",
                                               "LOCUS_SERVER_NAME", "LOCUS_TOKEN_FILE"};
  const test::TemporaryFolder folder_;
  const std::string path_ = folder_.file("contexts");
  client::SavedContexts contexts_;
};

TEST_F(ConnectionOptionsTest, TheDefaultContextFillsWhatIsNotGiven) {
  const ConnectionOptions options = parsed({"--ca", "/mine.pem"});
  EXPECT_EQ(options.address, "usual:1");
  EXPECT_EQ(options.credentials.ca_file, "/mine.pem");
  EXPECT_EQ(options.credentials.token_file, "/usual.token");
}

TEST_F(ConnectionOptionsTest, CredentialsOfTheDefaultContextDoNotReachAnAddressThatIsGiven) {
  EXPECT_EQ(parsed({"--address", "other:1"}).credentials.token_file, "");
  setenv("LOCUS_ADDRESS", "other:1", 1);
  const ConnectionOptions options = parsed({});
  EXPECT_EQ(options.address, "other:1");
  EXPECT_EQ(options.credentials.token_file, "");
}

TEST_F(ConnectionOptionsTest, LineComesBeforeEnvironmentAndEnvironmentBeforeContext) {
  setenv("LOCUS_CONTEXT", "prod", 1);
  setenv("LOCUS_ADDRESS", "environment:1", 1);
  setenv("LOCUS_TOKEN_FILE", "/environment.token", 1);
  const ConnectionOptions options = parsed({"--address", "line:1"});
  EXPECT_EQ(options.address, "line:1");
  EXPECT_EQ(options.credentials.token_file, "/environment.token");
  EXPECT_EQ(options.credentials.certificate_file, "/prod.pem");
  EXPECT_EQ(options.credentials.key_file, "/prod.key");
  EXPECT_TRUE(options.credentials.tls);
  EXPECT_EQ(options.credentials.server_name, "inner");
  EXPECT_EQ(parsed({"--context", "prod", "--server-name", "mine"}).credentials.server_name, "mine");
  EXPECT_EQ(parsed({"--context", "usual"}).credentials.ca_file, "/usual.pem");
}

TEST_F(ConnectionOptionsTest, ACertificateOfTheLineIsNotMixedWithTheKeyOfTheContext) {
  const ConnectionOptions options = parsed({"--context", "prod", "--cert", "/mine.pem"});
  EXPECT_EQ(options.credentials.certificate_file, "/mine.pem");
  EXPECT_EQ(options.credentials.key_file, "");
}

TEST_F(ConnectionOptionsTest, ATokenFileComesBeforeTheTokenOfTheEnvironmentAndThatBeforeTheContext) {
  ConnectionOptions options;
  options.credentials.token = "secret";
  ASSERT_TRUE(parse({}, options).ok());
  EXPECT_EQ(options.credentials.token, "secret");
  EXPECT_EQ(options.credentials.token_file, "");
  ASSERT_TRUE(parse({"--token-file", "/mine.token"}, options).ok());
  EXPECT_EQ(options.credentials.token, "");
  EXPECT_EQ(options.credentials.token_file, "/mine.token");
}

TEST_F(ConnectionOptionsTest, AnUnknownContextIsNotFound) {
  ConnectionOptions options;
  EXPECT_TRUE(absl::IsNotFound(parse({"--context", "nowhere"}, options)));
}

}  // namespace
}  // namespace locus::cli
