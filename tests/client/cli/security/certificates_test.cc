// Tests that gRPC accepts the certificates that `locus cert` makes, and rejects others: each test starts a server with
// TLS and connects clients to it.
#include "client/cli/security/certificates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "client/lib/client.h"
#include "tests/client/lib/guarded_server.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using client::testing::GuardedServer;
using ::testing::HasSubstr;

CertificatePair issued(const CertificatePlan& plan, const CertificatePair& authority = {}) {
  const absl::StatusOr<CertificatePair> made = make_certificate(plan, authority);
  EXPECT_TRUE(made.ok()) << made.status();
  return made.ok() ? *made : CertificatePair();
}

CertificatePair new_authority() { return issued({.use = CertificateUse::kAuthority, .common_name = "authority"}); }

// Returns whether a call succeeds between a server and a client with these certificates.
bool connects(const CertificatePair& authority, const CertificatePair& server, const CertificatePair& client) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(write_certificate(folder.file("ca"), authority).ok());
  EXPECT_TRUE(write_certificate(folder.file("client"), client).ok());
  grpc::SslServerCredentialsOptions options(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_root_certs = authority.certificate;
  options.pem_key_cert_pairs.push_back({server.key, server.certificate});
  const GuardedServer guarded(grpc::SslServerCredentials(options));
  client::ClientOptions client_options;
  client_options.retry.max_attempts = 1;
  client_options.credentials = {.ca_file = folder.file("ca.pem"),
                                .certificate_file = folder.file("client.pem"),
                                .key_file = folder.file("client.key")};
  const auto connected = client::Client::connect(guarded.address(), client_options);
  return connected.ok() && (*connected)->get_server().ok();
}

TEST(CertificatesTest, AServerAndAClientOfOneAuthorityConnectWithMutualTls) {
  const CertificatePair authority = new_authority();
  const CertificatePair server =
      issued({.common_name = "localhost", .dns_names = {"localhost"}, .addresses = {"127.0.0.1", "::1"}}, authority);
  const CertificatePair client = issued({.use = CertificateUse::kClient, .common_name = "lobby"}, authority);
  EXPECT_TRUE(connects(authority, server, client));
}

TEST(CertificatesTest, ACertificateServesOnlyItsOwnUseNameAndAuthority) {
  const CertificatePair authority = new_authority();
  const CertificatePlan here = {.common_name = "here", .addresses = {"127.0.0.1"}};
  const CertificatePair server = issued(here, authority);
  const CertificatePlan lobby = {.use = CertificateUse::kClient, .common_name = "lobby"};
  const CertificatePair client = issued(lobby, authority);
  EXPECT_FALSE(connects(authority, client, client)) << "a client's certificate as a server's";
  EXPECT_FALSE(connects(authority, server, server)) << "a server's certificate as a client's";
  EXPECT_FALSE(connects(authority, issued({.common_name = "x", .addresses = {"10.0.0.1"}}, authority), client));
  const CertificatePair other = new_authority();
  EXPECT_FALSE(connects(authority, issued(here, other), client));
  EXPECT_FALSE(connects(authority, server, issued(lobby, other)));
}

TEST(CertificatesTest, NamesThatCouldAddOtherNamesAreRefused) {
  const CertificatePair authority = new_authority();
  for (const CertificatePlan& plan : std::vector<CertificatePlan>{{.common_name = ""},
                                                                  {.common_name = std::string(65, 'x')},
                                                                  {.common_name = "a\nb"},
                                                                  {.common_name = "a", .dns_names = {"a,DNS:b"}},
                                                                  {.common_name = "a", .dns_names = {""}},
                                                                  {.common_name = "a", .addresses = {"1.2.3"}},
                                                                  {.common_name = "a", .addresses = {"::1,DNS:b"}}})
    EXPECT_EQ(make_certificate(plan, authority).status().code(), absl::StatusCode::kInvalidArgument);
  const CertificatePair mixed = {authority.certificate, new_authority().key};
  EXPECT_EQ(make_certificate({.common_name = "a"}, mixed).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(CertificatesTest, FilesAreNeverOverwrittenAndTheKeyIsPrivate) {
  const test::TemporaryFolder folder;
  const CertificatePair first = new_authority();
  ASSERT_TRUE(write_certificate(folder.file("ca"), first).ok());
  EXPECT_TRUE(absl::IsAlreadyExists(write_certificate(folder.file("ca"), new_authority())));
  EXPECT_EQ(read_certificate(folder.file("ca"))->key, first.key);
  struct stat status {};
  ASSERT_EQ(::stat(folder.file("ca.key").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  ASSERT_EQ(std::remove(folder.file("ca.key").c_str()), 0);
  EXPECT_TRUE(absl::IsAlreadyExists(write_certificate(folder.file("ca"), new_authority())));
  EXPECT_NE(::stat(folder.file("ca.key").c_str(), &status), 0) << "a key without its certificate stays behind";
}

}  // namespace
}  // namespace locus::cli
