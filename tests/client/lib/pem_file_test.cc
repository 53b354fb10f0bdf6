#include "client/lib/pem_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const test::TestAuthority& an_authority() {
  static const test::TestAuthority authority("test authority");
  return authority;
}

std::string message_of(const absl::Status& status) { return std::string(status.message()); }

TEST(PemFileTest, AMissingAnEmptyAndALargeFileAreRefusedByName) {
  const test::TemporaryFolder folder;
  const absl::Status missing = read_small_file("ca_file", folder.file("no")).status();
  EXPECT_TRUE(absl::IsNotFound(missing));
  EXPECT_THAT(message_of(missing), AllOf(HasSubstr("ca_file"), HasSubstr(folder.file("no"))));
  std::ofstream(folder.file("empty")).flush();
  EXPECT_THAT(message_of(read_small_file("ca_file", folder.file("empty")).status()), HasSubstr("is empty"));
  std::ofstream(folder.file("large")) << std::string(kMaxCredentialBytes + 1, 'x');
  EXPECT_THAT(message_of(read_small_file("ca_file", folder.file("large")).status()), HasSubstr("larger than"));
  EXPECT_EQ(read_small_file("ca_file", folder.path()).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(PemFileTest, ATextOfTheLargestSizeIsRead) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("full")) << std::string(kMaxCredentialBytes, 'x');
  EXPECT_EQ(read_small_file("ca_file", folder.file("full"))->size(), kMaxCredentialBytes);
}

TEST(PemFileTest, CertificatesAreAcceptedOnlyIfEachIsWellFormed) {
  const std::string good = an_authority().certificate();
  EXPECT_TRUE(check_certificates("ca.pem", good + good).ok());
  EXPECT_THAT(message_of(check_certificates("ca.pem", "nothing")), HasSubstr("ca.pem has no certificate"));
  std::string damaged = good;
  damaged.replace(damaged.find('\n') + 1, 8, "AAAAAAAA");
  EXPECT_THAT(message_of(check_certificates("ca.pem", good + damaged)), HasSubstr("a malformed certificate"));
}

TEST(PemFileTest, AKeyIsAcceptedOnlyWithItsOwnCertificate) {
  const test::TestCertificate own = an_authority().for_server();
  const test::TestCertificate other = an_authority().for_server();
  EXPECT_TRUE(check_key("a.key", own.key, own.certificate).ok());
  EXPECT_THAT(message_of(check_key("a.key", other.key, own.certificate)), HasSubstr("a.key is not the key"));
  EXPECT_THAT(message_of(check_key("a.key", own.certificate, own.certificate)), HasSubstr("has no private key"));
}

}  // namespace
}  // namespace locus::client
