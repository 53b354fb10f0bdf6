// Tests of `locus context`, and of command lines that connect through a context.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "client/cli/run.h"
#include "client/lib/saved_contexts.h"
#include "tests/client/lib/guarded_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::cli {
namespace {

using client::testing::GuardedServer;
using ::testing::HasSubstr;
using ::testing::Not;

class ContextCommandTest : public ::testing::Test {
 protected:
  ExitCode run_with_contexts(const std::vector<std::string>& arguments) {
    out_.str("");
    err_.str("");
    Context context(out_, err_, Progress::kSilent);
    context.set_contexts_path(path_);
    return run_line(arguments, context);
  }
  std::string written(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }

  const test::TemporaryFolder folder_;
  const std::string path_ = folder_.file("contexts");
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(ContextCommandTest, AContextIsSetShownListedUsedAndRemoved) {
  ASSERT_EQ(run_with_contexts({"context", "set", "prod", "--address", "host:1", "--ca", "ca.pem", "--tls"}),
            ExitCode::kOk)
      << err_.str();
  ASSERT_EQ(run_with_contexts({"-o", "json", "context", "show", "prod"}), ExitCode::kOk);
  const Json shown = Json::parse(out_.str(), nullptr, /*allow_exceptions=*/false);
  EXPECT_EQ(shown["address"], "host:1");
  EXPECT_EQ(shown["tls"], "true");
  EXPECT_EQ(shown["ca"].get<std::string>().front(), '/') << "a relative path would mean another file elsewhere";
  EXPECT_EQ(run_with_contexts({"context", "show"}), ExitCode::kNotFound) << "no default yet";
  ASSERT_EQ(run_with_contexts({"context", "use", "prod"}), ExitCode::kOk);
  EXPECT_EQ(run_with_contexts({"context", "show"}), ExitCode::kOk);
  ASSERT_EQ(run_with_contexts({"-o", "csv", "context", "list"}), ExitCode::kOk);
  EXPECT_THAT(out_.str(), HasSubstr("prod,true,host:1,true,"));
  ASSERT_EQ(run_with_contexts({"context", "remove", "prod"}), ExitCode::kOk);
  EXPECT_EQ(run_with_contexts({"context", "use", "prod"}), ExitCode::kNotFound);
  EXPECT_EQ(client::read_contexts(path_)->default_name, "");
}

TEST_F(ContextCommandTest, ShowingAContextPrintsTheNameOfTheTokenFileAndNoToken) {
  const std::string token_file = written("token", "secret");
  ASSERT_EQ(run_with_contexts({"context", "set", "prod", "--token-file", token_file}), ExitCode::kOk);
  for (const std::vector<std::string>& line :
       std::vector<std::vector<std::string>>{{"context", "show", "prod"}, {"context", "list"}}) {
    ASSERT_EQ(run_with_contexts(line), ExitCode::kOk);
    EXPECT_THAT(out_.str(), HasSubstr(token_file));
    EXPECT_THAT(out_.str(), Not(HasSubstr("secret")));
  }
}

TEST_F(ContextCommandTest, ALineConnectsWithTheCredentialsOfItsContext) {
  const test::TestAuthority authority("test authority");
  const test::TestCertificate own = authority.for_server();
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({own.key, own.certificate});
  GuardedServer server(grpc::SslServerCredentials(options));
  server.require("secret");
  ASSERT_EQ(run_with_contexts({"context", "set", "prod", "--address", server.address(), "--ca",
                               written("ca.pem", authority.certificate()), "--token-file", written("token", "secret")}),
            ExitCode::kOk);
  EXPECT_EQ(run_with_contexts({"--context", "prod", "version", "--server"}), ExitCode::kOk) << err_.str();
  EXPECT_EQ(server.authorization_of("GetServer"), "Bearer secret");
  EXPECT_EQ(run_with_contexts({"--context", "prod", "--token-file", written("wrong", "other"), "version", "--server"}),
            ExitCode::kDenied);
  EXPECT_THAT(err_.str(), HasSubstr("hint: --token-file"));
  EXPECT_EQ(run_with_contexts({"--address", server.address(), "version", "--server"}), ExitCode::kUnreachable);
  EXPECT_THAT(err_.str(), HasSubstr("it may require TLS"));
}

TEST_F(ContextCommandTest, AnOptionThatWouldNotBeKeptIsRefused) {
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"-a", "host:1"}, {"--tls"}, {"--token-file", "token"}}) {
    std::vector<std::string> line = options;
    line.insert(line.end(), {"context", "set", "net", "--ca", "ca.pem"});
    EXPECT_EQ(run_with_contexts(line), ExitCode::kUsage) << options.front();
    EXPECT_THAT(err_.str(), HasSubstr("after the name"));
  }
  EXPECT_EQ(run_with_contexts({"context", "set", "net", "--context", "other"}), ExitCode::kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("has no --context"));
  EXPECT_TRUE(client::read_contexts(path_)->by_name.empty());
  setenv("LOCUS_ADDRESS", "host:2", 1);
  EXPECT_EQ(run_with_contexts({"context", "set", "net", "-a", "host:1"}), ExitCode::kOk) << err_.str();
  EXPECT_EQ(run_with_contexts({"-a", "host:3", "context", "set", "net"}), ExitCode::kUsage);
  unsetenv("LOCUS_ADDRESS");
  EXPECT_EQ(client::read_contexts(path_)->by_name.at("net").address, "host:1");
}

TEST_F(ContextCommandTest, AnUnknownContextIsAnErrorOnlyForLinesThatConnect) {
  EXPECT_EQ(run_with_contexts({"--context", "nowhere", "limits"}), ExitCode::kNotFound);
  EXPECT_EQ(run_with_contexts({"--context", "nowhere", "version"}), ExitCode::kOk);
}

TEST_F(ContextCommandTest, AValueWithALineBreakIsRefused) {
  EXPECT_EQ(run_with_contexts({"context", "set", "prod", "--address", "a\ntoken_file = /b"}), ExitCode::kUsage);
  EXPECT_EQ(run_with_contexts({"context", "set", "a b"}), ExitCode::kFailed);
}

}  // namespace
}  // namespace locus::cli
