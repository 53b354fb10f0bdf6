#include "server/security/tls_files.h"

#include <gmock/gmock.h>

#include <chrono>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::server {
namespace {

using test::TestAuthority;
using test::TestCertificate;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TlsFilesTest : public ::testing::Test {
 protected:
  absl::Status check(const TestCertificate& pair, const std::string& client_ca = "") const {
    TlsFiles files = files_;
    if (client_ca.empty()) files.client_ca.clear();
    return check_tls_contents(files, {pair.certificate, pair.key, client_ca});
  }
  static std::string text(const absl::Status& status) { return std::string(status.message()); }

  const TestAuthority authority_{"authority"};
  const TlsFiles files_{"server.crt", "server.key", "clients.crt"};
};

TEST_F(TlsFilesTest, ACertificateWithItsKeyIsGood) {
  EXPECT_EQ(check(authority_.for_server()), absl::OkStatus());
  EXPECT_EQ(check(authority_.for_server(), authority_.certificate()), absl::OkStatus());
  TestCertificate with_chain = authority_.for_server();
  with_chain.certificate += authority_.certificate();
  EXPECT_EQ(check(with_chain), absl::OkStatus());
  EXPECT_EQ(check(authority_.issue({.common_name = "rsa", .rsa_bits = 2048})), absl::OkStatus());
}

TEST_F(TlsFilesTest, AKeyOfAnotherCertificateIsRefused) {
  const TestCertificate mixed{authority_.for_server().certificate, authority_.for_server().key};
  EXPECT_THAT(text(check(mixed)), HasSubstr("the file server.key is not the key of the certificate in server.crt"));
}

TEST_F(TlsFilesTest, FilesWithoutACertificateOrAKeyAreRefusedByName) {
  const TestCertificate good = authority_.for_server();
  EXPECT_THAT(text(check({"", good.key})), HasSubstr("server.crt has no certificate"));
  EXPECT_THAT(text(check({"nonsense", good.key})), HasSubstr("server.crt has no certificate"));
  EXPECT_THAT(text(check({good.certificate, ""})), HasSubstr("server.key has no private key"));
  EXPECT_THAT(text(check({good.certificate, good.certificate})), HasSubstr("server.key has no private key"));
  EXPECT_THAT(text(check(good, "nonsense")), HasSubstr("clients.crt has no certificate"));
}

TEST_F(TlsFilesTest, AFileThatIsCutAnywhereIsRefused) {
  const TestCertificate good = authority_.for_server();
  for (size_t size = 0; size + 2 < good.certificate.size(); size += 7)
    EXPECT_FALSE(check({good.certificate.substr(0, size), good.key}).ok()) << size;
  for (size_t size = 0; size + 2 < good.key.size(); size += 7)
    EXPECT_FALSE(check({good.certificate, good.key.substr(0, size)}).ok()) << size;
  const std::string chain = good.certificate + authority_.certificate();
  EXPECT_THAT(text(check({chain.substr(0, good.certificate.size() + 200), good.key})), HasSubstr("cannot be read"));
}

TEST_F(TlsFilesTest, AKeyThatIsTooShortIsRefused) {
  EXPECT_THAT(text(check(authority_.issue({.common_name = "short", .rsa_bits = 1024}))), HasSubstr("server.crt"));
}

TEST_F(TlsFilesTest, TimesAndOrderOfCertificatesAreWarnings) {
  const auto warnings = [this](const TestCertificate& pair) {
    return warnings_about({files_.certificate, files_.key, ""}, {pair.certificate, pair.key, ""});
  };
  EXPECT_THAT(warnings(authority_.for_server()), IsEmpty());
  const TestCertificate old = authority_.issue({.common_name = "old", .valid_from_s = -7200, .valid_to_s = -3600});
  EXPECT_EQ(check(old), absl::OkStatus());
  EXPECT_THAT(warnings(old), ElementsAre(HasSubstr("has expired")));
  EXPECT_THAT(warnings(authority_.issue({.common_name = "new", .valid_from_s = 3600})),
              ElementsAre(HasSubstr("is not yet valid")));
  TestCertificate odd = authority_.for_server();
  odd.certificate += TestAuthority("other").certificate();
  EXPECT_THAT(warnings(odd), ElementsAre(HasSubstr("is not followed by that of its issuer")));
}

TEST_F(TlsFilesTest, FilesAreReadAndMissingOnesAreNamed) {
  const test::TemporaryFolder folder;
  const TestCertificate good = authority_.for_server();
  test::replace_file(folder.file("c"), good.certificate);
  test::replace_file(folder.file("k"), good.key);
  const auto contents = read_tls_files({folder.file("c"), folder.file("k"), ""});
  ASSERT_TRUE(contents.ok()) << contents.status();
  EXPECT_EQ(contents->certificate, good.certificate);
  EXPECT_EQ(contents->key, good.key);
  EXPECT_THAT(text(read_tls_files({folder.file("c"), folder.file("gone"), ""}).status()), HasSubstr("/gone"));
  test::replace_file(folder.file("large"), std::string(kMaxTlsFileBytes + 1, 'x'));
  EXPECT_THAT(text(read_tls_files({folder.file("large"), folder.file("k"), ""}).status()), HasSubstr("is larger than"));
}

TEST_F(TlsFilesTest, ACertificateEndsAfterItsLastSecond) {
  const int64_t now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  const int64_t end = certificate_end(authority_.issue({.common_name = "game", .valid_to_s = 3600}).certificate);
  EXPECT_GE(end, now + 3600);
  EXPECT_LE(end, now + 3660);
  EXPECT_EQ(certificate_end("nonsense"), 0);
}

TEST_F(TlsFilesTest, ACertificateIsMissedWhereverItStood) {
  const std::string first = authority_.certificate(), second = TestAuthority("second").certificate();
  EXPECT_FALSE(lacks_certificate(first, first));
  EXPECT_FALSE(lacks_certificate(first, second + first));
  EXPECT_TRUE(lacks_certificate(second + first, second));
  EXPECT_TRUE(lacks_certificate(second + first, first));
  EXPECT_TRUE(lacks_certificate(first, TestAuthority("authority").certificate())) << "same name, other key";
}

}  // namespace
}  // namespace locus::server
