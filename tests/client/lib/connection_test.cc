// Tests of connections with TLS between a client and a server in this process.
#include "client/lib/connection.h"

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

class TlsTest : public ::testing::Test {
 protected:
  // Returns a server whose certificate comes from authority_. With `mutual`, the server refuses clients without a
  // certificate of that authority.
  std::unique_ptr<GuardedServer> server(bool mutual) {
    const test::TestCertificate own = authority_.for_server();
    grpc::SslServerCredentialsOptions options(mutual ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                                     : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
    options.pem_root_certs = authority_.certificate();
    options.pem_key_cert_pairs.push_back({own.key, own.certificate});
    return std::make_unique<GuardedServer>(grpc::SslServerCredentials(options));
  }
  std::string written(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }
  std::string ca() { return written("ca.pem", authority_.certificate()); }

  // Connects and makes one call. Returns the first error, or OK.
  static absl::Status ask(const std::string& address, const CredentialOptions& credentials) {
    ClientOptions options;
    options.credentials = credentials;
    options.retry.max_attempts = 1;
    const absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(address, options);
    return client.ok() ? (*client)->get_server().status() : client.status();
  }
  static std::string error_of_asking(const std::string& address, const CredentialOptions& credentials) {
    const absl::Status status = ask(address, credentials);
    EXPECT_TRUE(absl::IsUnavailable(status)) << status;
    return std::string(status.message());
  }

  const test::TestAuthority authority_{"test authority"};
  const test::TemporaryFolder folder_;
};

TEST_F(TlsTest, TheCaFileOfTheServersAuthorityConnects) {
  const auto server = this->server(false);
  EXPECT_TRUE(ask(server->address(), {.ca_file = ca()}).ok());
}

TEST_F(TlsTest, ACertificateOfAnotherAuthorityIsRefusedWithARemedy) {
  const auto server = this->server(false);
  const std::string other = written("other.pem", test::TestAuthority("other").certificate());
  EXPECT_THAT(error_of_asking(server->address(), {.ca_file = other}), HasSubstr("give the CA file"));
  EXPECT_THAT(error_of_asking(server->address(), {.tls = true}), HasSubstr("give the CA file"));
}

TEST_F(TlsTest, AServerNameThatTheCertificateLacksIsRefusedWithARemedy) {
  const auto server = this->server(false);
  EXPECT_THAT(error_of_asking(server->address(), {.ca_file = ca(), .server_name = "elsewhere"}),
              HasSubstr("is for other names"));
}

TEST_F(TlsTest, TheServerNameReplacesTheHostOfTheAddress) {
  test::CertificateOptions options{.common_name = "x", .alternative_names = "DNS:locus.example"};
  const test::TestCertificate own = authority_.issue(options);
  grpc::SslServerCredentialsOptions server_options;
  server_options.pem_key_cert_pairs.push_back({own.key, own.certificate});
  const GuardedServer server(grpc::SslServerCredentials(server_options));
  EXPECT_TRUE(ask(server.address(), {.ca_file = ca(), .server_name = "locus.example"}).ok());
  EXPECT_THAT(error_of_asking(server.address(), {.ca_file = ca()}), HasSubstr("is for other names"));
}

TEST_F(TlsTest, AServerWithTlsRefusesAConnectionWithoutItWithARemedy) {
  const auto server = this->server(false);
  EXPECT_THAT(error_of_asking(server->address(), {}), HasSubstr("it may require TLS"));
}

TEST_F(TlsTest, AServerWithoutTlsRefusesAConnectionWithItWithARemedy) {
  const GuardedServer server;
  EXPECT_THAT(error_of_asking(server.address(), {.ca_file = ca()}), HasSubstr("connect without it"));
}

TEST_F(TlsTest, MutualTlsAcceptsOnlyClientsWithACertificateOfTheAuthority) {
  const auto server = this->server(true);
  const test::TestCertificate own = authority_.issue({.common_name = "lobby"});
  const std::string certificate = written("client.pem", own.certificate);
  const std::string key = written("client.key", own.key);
  EXPECT_TRUE(ask(server->address(), {.ca_file = ca(), .certificate_file = certificate, .key_file = key}).ok());
  EXPECT_THAT(error_of_asking(server->address(), {.ca_file = ca()}), HasSubstr("a client certificate that it knows"));
  const test::TestCertificate stranger = test::TestAuthority("other").issue({.common_name = "lobby"});
  const CredentialOptions wrong = {.ca_file = ca(),
                                   .certificate_file = written("wrong.pem", stranger.certificate),
                                   .key_file = written("wrong.key", stranger.key)};
  EXPECT_THAT(error_of_asking(server->address(), wrong), HasSubstr("a client certificate that it knows"));
}

TEST_F(TlsTest, AnExpiredCertificateIsRefused) {
  const test::TestCertificate own =
      authority_.issue({.alternative_names = "IP:127.0.0.1", .valid_from_s = -7200, .valid_to_s = -3600});
  grpc::SslServerCredentialsOptions server_options;
  server_options.pem_key_cert_pairs.push_back({own.key, own.certificate});
  const GuardedServer server(grpc::SslServerCredentials(server_options));
  EXPECT_THAT(error_of_asking(server.address(), {.ca_file = ca()}), HasSubstr("has expired"));
}

TEST_F(TlsTest, ACertificateWithoutItsKeyIsRefusedBeforeConnecting) {
  const absl::Status status = ask("127.0.0.1:1", {.certificate_file = ca()});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("give both or neither"));
}

}  // namespace
}  // namespace locus::client
