#include "client/lib/pem_file.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

#include "absl/strings/str_cat.h"

namespace locus::client {
namespace {

using BioPtr = std::unique_ptr<BIO, decltype(&BIO_free)>;
using CertificatePtr = std::unique_ptr<X509, decltype(&X509_free)>;
using KeyPtr = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

BioPtr reader_of(absl::string_view text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free};
}

CertificatePtr next_certificate(BIO* reader) {
  return {PEM_read_bio_X509(reader, nullptr, nullptr, nullptr), &X509_free};
}

// Password callback of OpenSSL. Returns the code for "no password", so that OpenSSL does not ask for a password on the
// terminal.
int no_password(char*, int, int, void*) { return -1; }

}  // namespace

absl::StatusOr<std::string> read_small_file(absl::string_view option, const std::string& file, EmptyFile empty) {
  std::ifstream opened(file, std::ios::binary);
  std::string text(kMaxCredentialBytes + 1, '\0');
  const bool is_open = opened.is_open();
  if (is_open) opened.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!is_open || opened.bad()) {
    const std::string message = absl::StrCat("cannot read ", option, " ", file, ": ", std::strerror(errno));
    return errno == ENOENT ? absl::NotFoundError(message) : absl::FailedPreconditionError(message);
  }
  text.resize(static_cast<size_t>(opened.gcount()));
  if (text.empty() && empty == kMustHaveContent)
    return absl::InvalidArgumentError(absl::StrCat(option, " ", file, " is empty"));
  if (text.size() > kMaxCredentialBytes)
    return absl::InvalidArgumentError(
        absl::StrCat(option, " ", file, " is larger than ", kMaxCredentialBytes, " bytes"));
  return text;
}

absl::Status check_certificates(const std::string& file, absl::string_view pem) {
  const BioPtr reader = reader_of(pem);
  int count = 0;
  while (next_certificate(reader.get())) ++count;
  const bool at_the_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  ERR_clear_error();
  if (count > 0 && at_the_end) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(file, " has ", count == 0 ? "no" : "a malformed", " certificate: give a file in PEM format"));
}

absl::Status check_key(const std::string& file, absl::string_view pem, absl::string_view certificates) {
  const KeyPtr key(PEM_read_bio_PrivateKey(reader_of(pem).get(), nullptr, &no_password, nullptr), &EVP_PKEY_free);
  const CertificatePtr certificate = next_certificate(reader_of(certificates).get());
  const bool fits = key && certificate && X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  if (!key) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, " has no private key, or one with a password: give a key in PEM format without password"));
  }
  if (fits) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(file, " is not the key of the client's certificate"));
}

}  // namespace locus::client
