#include "server/security/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* value) const {
    kFree(value);
  }
};
using BioPtr = std::unique_ptr<BIO, Free<BIO_free_all>>;
using CertificatePtr = std::unique_ptr<X509, Free<X509_free>>;
using KeyPtr = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using ContextPtr = std::unique_ptr<SSL_CTX, Free<SSL_CTX_free>>;
using FilePtr = std::unique_ptr<std::FILE, Free<std::fclose>>;
using Certificates = std::vector<CertificatePtr>;

absl::Status bad_tls_file(const std::string& path, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("the file ", path, " ", why));
}

// Returns the reason of the latest error of OpenSSL, and clears its list of errors.
std::string openssl_reason() {
  const unsigned long code = ERR_peek_last_error();
  ERR_clear_error();
  const char* reason = ERR_reason_error_string(code);
  return reason == nullptr ? "unknown error" : reason;
}

absl::StatusOr<std::string> read_tls_file(const std::string& path) {
  const FilePtr file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) return bad_tls_file(path, absl::StrCat("cannot be read: ", std::strerror(errno)));
  std::string text;
  std::array<char, 65536> piece;
  size_t count = 0;
  while ((count = std::fread(piece.data(), 1, piece.size(), file.get())) > 0) {
    text.append(piece.data(), count);
    if (text.size() > kMaxTlsFileBytes) return bad_tls_file(path, absl::StrCat("is larger than ", kMaxTlsFileBytes));
  }
  if (std::ferror(file.get()) != 0) return bad_tls_file(path, absl::StrCat("cannot be read: ", std::strerror(errno)));
  return text;
}

BioPtr reader_of(const std::string& text) {
  return BioPtr(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Returns all certificates of a file, at least one.
absl::StatusOr<Certificates> parse_certificates(const std::string& path, const std::string& text) {
  ERR_clear_error();
  const BioPtr reader = reader_of(text);
  Certificates all;
  while (X509* certificate = PEM_read_bio_X509(reader.get(), nullptr, nullptr, nullptr)) all.emplace_back(certificate);
  // PEM_R_NO_START_LINE only means that no further certificate follows; any other error is an error in a certificate.
  if (ERR_GET_REASON(ERR_peek_last_error()) != PEM_R_NO_START_LINE)
    return bad_tls_file(path, absl::StrCat("has a certificate that cannot be read: ", openssl_reason()));
  ERR_clear_error();
  if (all.empty()) return bad_tls_file(path, "has no certificate in PEM");
  return all;
}

int refuse_password(char*, int, int, void*) { return -1; }

absl::StatusOr<KeyPtr> parse_key(const std::string& path, const std::string& text) {
  ERR_clear_error();
  const BioPtr reader = reader_of(text);
  KeyPtr key(PEM_read_bio_PrivateKey(reader.get(), nullptr, refuse_password, nullptr));
  if (key != nullptr) return key;
  const std::string reason = openssl_reason();
  if (text.find("ENCRYPTED") != std::string::npos) return bad_tls_file(path, "is encrypted; store the key decrypted");
  return bad_tls_file(path, absl::StrCat("has no private key in PEM: ", reason));
}

// Tries the certificates and the key in a TLS context, which refuses keys that are too short, for example.
absl::Status try_in_context(const TlsFiles& files, Certificates& chain, EVP_PKEY& key) {
  const ContextPtr context(SSL_CTX_new(TLS_method()));
  if (context == nullptr) return absl::InternalError(openssl_reason());
  if (SSL_CTX_use_certificate(context.get(), chain.front().get()) != 1)
    return bad_tls_file(files.certificate, absl::StrCat("cannot be used: ", openssl_reason()));
  for (size_t i = 1; i < chain.size(); ++i) {
    if (SSL_CTX_add1_chain_cert(context.get(), chain[i].get()) != 1)
      return bad_tls_file(files.certificate, absl::StrCat("cannot be used: ", openssl_reason()));
  }
  if (X509_check_private_key(chain.front().get(), &key) != 1 || SSL_CTX_use_PrivateKey(context.get(), &key) != 1 ||
      SSL_CTX_check_private_key(context.get()) != 1)
    return bad_tls_file(
        files.key, absl::StrCat("is not the key of the certificate in ", files.certificate, ": ", openssl_reason()));
  return absl::OkStatus();
}

std::string subject_of(X509& certificate) {
  std::array<char, 256> text{};
  X509_NAME_oneline(X509_get_subject_name(&certificate), text.data(), static_cast<int>(text.size()));
  return text.data();
}

void warn_of_times(const std::string& path, const Certificates& certificates, std::vector<std::string>& warnings) {
  for (const CertificatePtr& certificate : certificates) {
    const std::string name = absl::StrCat("the certificate ", subject_of(*certificate), " in ", path);
    if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0)
      warnings.push_back(absl::StrCat(name, " has expired"));
    if (X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0)
      warnings.push_back(absl::StrCat(name, " is not yet valid"));
  }
}

}  // namespace

absl::StatusOr<TlsContents> read_tls_files(const TlsFiles& files) {
  TlsContents contents;
  ASSIGN_OR_RETURN(contents.certificate, read_tls_file(files.certificate));
  ASSIGN_OR_RETURN(contents.key, read_tls_file(files.key));
  if (!files.client_ca.empty()) {
    ASSIGN_OR_RETURN(contents.client_ca, read_tls_file(files.client_ca));
  }
  return contents;
}

absl::Status check_tls_contents(const TlsFiles& files, const TlsContents& contents) {
  ASSIGN_OR_RETURN(Certificates chain, parse_certificates(files.certificate, contents.certificate));
  ASSIGN_OR_RETURN(const KeyPtr key, parse_key(files.key, contents.key));
  RETURN_IF_ERROR(try_in_context(files, chain, *key));
  if (files.client_ca.empty()) return absl::OkStatus();
  return parse_certificates(files.client_ca, contents.client_ca).status();
}

std::vector<std::string> warnings_about(const TlsFiles& files, const TlsContents& contents) {
  std::vector<std::string> warnings;
  const absl::StatusOr<Certificates> chain = parse_certificates(files.certificate, contents.certificate);
  if (!chain.ok()) return warnings;
  warn_of_times(files.certificate, *chain, warnings);
  for (size_t i = 0; i + 1 < chain->size(); ++i)
    if (X509_check_issued((*chain)[i + 1].get(), (*chain)[i].get()) != X509_V_OK)
      warnings.push_back(absl::StrCat("in ", files.certificate, ", the certificate ", subject_of(*(*chain)[i]),
                                      " is not followed by that of its issuer"));
  if (files.client_ca.empty()) return warnings;
  const absl::StatusOr<Certificates> roots = parse_certificates(files.client_ca, contents.client_ca);
  if (roots.ok()) warn_of_times(files.client_ca, *roots, warnings);
  return warnings;
}

int64_t certificate_end(const std::string& pem) {
  const absl::StatusOr<Certificates> certificates = parse_certificates("", pem);
  std::tm last{};  // last second in which the certificate is valid
  if (!certificates.ok() || ASN1_TIME_to_tm(X509_get0_notAfter(certificates->front().get()), &last) != 1) return 0;
  return int64_t{::timegm(&last)} + 1;
}

bool lacks_certificate(const std::string& before, const std::string& now) {
  const absl::StatusOr<Certificates> old = parse_certificates("", before), present = parse_certificates("", now);
  if (!old.ok()) return false;
  if (!present.ok()) return true;
  return std::any_of(old->begin(), old->end(), [&](const CertificatePtr& certificate) {
    return std::none_of(present->begin(), present->end(),
                        [&](const CertificatePtr& other) { return X509_cmp(certificate.get(), other.get()) == 0; });
  });
}

}  // namespace locus::server
