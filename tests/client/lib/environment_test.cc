#include "client/lib/environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace locus::client {
namespace {

using ::testing::HasSubstr;

// An environment without the variables of locus, and a file with two contexts.
class EnvironmentTest : public ::testing::Test {
 protected:
  void SetUp() override {
    clear();
    std::filesystem::create_directories(folder_.file("locus"));
    std::ofstream(folder_.file("locus/contexts")) << "default = usual\n"
                                                  << "[usual]\naddress = usual:1\nca = /usual.pem\n"
                                                  << "[prod]\naddress = prod:1\ntls = true\ncert = /prod.pem\n"
                                                  << "key = /prod.key\nserver_name = inner\ntoken_file = /prod.token\n";
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
  }
  void TearDown() override { clear(); }

  static void clear() {
    for (const char* name : {"LOCUS_ADDRESS", "LOCUS_CONTEXT", "LOCUS_TLS", "LOCUS_CA", "LOCUS_CERT", "LOCUS_KEY",
                             "LOCUS_SERVER_NAME", "LOCUS_TOKEN", "LOCUS_TOKEN_FILE", "XDG_CONFIG_HOME"})
      unsetenv(name);
  }
  static Endpoint endpoint(const std::string& context = {}) {
    const absl::StatusOr<Endpoint> found = endpoint_from_environment(context);
    EXPECT_TRUE(found.ok()) << found.status();
    return found.ok() ? *found : Endpoint();
  }

  const test::TemporaryFolder folder_;
};

TEST_F(EnvironmentTest, WithoutVariablesItIsTheDefaultContext) {
  EXPECT_EQ(endpoint().address, "usual:1");
  EXPECT_EQ(endpoint().credentials.ca_file, "/usual.pem");
  EXPECT_FALSE(endpoint().credentials.tls);
}

TEST_F(EnvironmentTest, WithoutContextsItIsTheDefaultAddress) {
  setenv("XDG_CONFIG_HOME", "/nonexistent", 1);
  EXPECT_EQ(endpoint().address, kDefaultAddress);
}

TEST_F(EnvironmentTest, EveryVariableIsRead) {
  setenv("LOCUS_ADDRESS", "other:1", 1);
  setenv("LOCUS_TLS", "true", 1);
  setenv("LOCUS_CA", "/ca.pem", 1);
  setenv("LOCUS_CERT", "/own.pem", 1);
  setenv("LOCUS_KEY", "/own.key", 1);
  setenv("LOCUS_SERVER_NAME", "name", 1);
  setenv("LOCUS_TOKEN", "secret", 1);
  const Endpoint found = endpoint();
  EXPECT_EQ(found.address, "other:1");
  EXPECT_TRUE(found.credentials.tls);
  EXPECT_EQ(found.credentials.ca_file, "/ca.pem");
  EXPECT_EQ(found.credentials.certificate_file, "/own.pem");
  EXPECT_EQ(found.credentials.key_file, "/own.key");
  EXPECT_EQ(found.credentials.server_name, "name");
  EXPECT_EQ(found.credentials.token, "secret");
  EXPECT_EQ(found.credentials.token_file, "");
  setenv("LOCUS_TOKEN_FILE", "/token", 1);
  EXPECT_EQ(endpoint().credentials.token, "") << "a token file comes before a token";
  EXPECT_EQ(endpoint().credentials.token_file, "/token");
}

TEST_F(EnvironmentTest, CredentialsOfTheDefaultContextDoNotReachTheAddressOfTheEnvironment) {
  setenv("LOCUS_ADDRESS", "other:1", 1);
  EXPECT_EQ(endpoint().credentials.ca_file, "");
}

TEST_F(EnvironmentTest, ANamedContextGivesWhatTheVariablesLeaveOpen) {
  setenv("LOCUS_CA", "/mine.pem", 1);
  setenv("LOCUS_CONTEXT", "prod", 1);
  for (const Endpoint& found : {endpoint(), endpoint("prod")}) {
    EXPECT_EQ(found.address, "prod:1");
    EXPECT_TRUE(found.credentials.tls);
    EXPECT_EQ(found.credentials.ca_file, "/mine.pem");
    EXPECT_EQ(found.credentials.key_file, "/prod.key");
    EXPECT_EQ(found.credentials.server_name, "inner");
    EXPECT_EQ(found.credentials.token_file, "/prod.token");
  }
  EXPECT_EQ(endpoint("usual").address, "usual:1") << "the argument comes before LOCUS_CONTEXT";
  setenv("LOCUS_TLS", "false", 1);
  EXPECT_FALSE(endpoint().credentials.tls);
}

TEST_F(EnvironmentTest, MistakesAreNamed) {
  EXPECT_TRUE(absl::IsNotFound(endpoint_from_environment("nowhere").status()));
  setenv("LOCUS_TLS", "perhaps", 1);
  const absl::Status status = endpoint_from_environment().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("LOCUS_TLS is true or false, not 'perhaps'"));
}

}  // namespace
}  // namespace locus::client
