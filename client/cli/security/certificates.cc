#include "client/cli/security/certificates.h"

#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <algorithm>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/security/private_file.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Deleter for objects of OpenSSL.
template <auto Free>
struct FreedBy {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Certificate = std::unique_ptr<X509, FreedBy<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, FreedBy<EVP_PKEY_free>>;
using Memory = std::unique_ptr<BIO, FreedBy<BIO_free_all>>;
using Extension = std::unique_ptr<X509_EXTENSION, FreedBy<X509_EXTENSION_free>>;
using BigNumber = std::unique_ptr<BIGNUM, FreedBy<BN_free>>;

constexpr size_t kMaxCommonName = 64;
// Validity begins this much earlier than now, since the clocks of other machines may be behind.
constexpr long kSecondsBeforeNow = 300;

absl::Status openssl_error() {
  char text[256] = "";
  ERR_error_string_n(ERR_get_error(), text, sizeof text);
  ERR_clear_error();
  return absl::InternalError(absl::StrCat("OpenSSL made no certificate: ", text));
}

bool is_host_name(const std::string& name) {
  return !name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '-' || c == '.' || c == '*' || c == '_';
  });
}

bool is_ip_address(const std::string& text) {
  in6_addr unused{};
  return inet_pton(AF_INET, text.c_str(), &unused) == 1 || inet_pton(AF_INET6, text.c_str(), &unused) == 1;
}

// Checks the names of the certificate. A host name or an address with a comma is refused, because a comma would begin
// another name in OpenSSL's extension texts.
absl::Status check_names(const CertificatePlan& plan) {
  const std::string& common = plan.common_name;
  if (common.empty() || common.size() > kMaxCommonName ||
      !std::all_of(common.begin(), common.end(), absl::ascii_isprint))
    return absl::InvalidArgumentError("a name has 1 to 64 visible ASCII characters");
  for (const std::string& name : plan.dns_names)
    if (!is_host_name(name)) return absl::InvalidArgumentError(absl::StrCat(name, " is no host name"));
  for (const std::string& address : plan.addresses)
    if (!is_ip_address(address)) return absl::InvalidArgumentError(absl::StrCat(address, " is no IP address"));
  return absl::OkStatus();
}

std::string alternative_names(const CertificatePlan& plan) {
  std::vector<std::string> names;
  for (const std::string& name : plan.dns_names) names.push_back(absl::StrCat("DNS:", name));
  for (const std::string& address : plan.addresses) names.push_back(absl::StrCat("IP:", address));
  return absl::StrJoin(names, ",");
}

bool extend(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

bool extend_for_use(X509* certificate, X509* issuer, const CertificatePlan& plan) {
  const std::string names = alternative_names(plan);
  const bool named = names.empty() || extend(certificate, issuer, NID_subject_alt_name, names);
  if (plan.use == CertificateUse::kAuthority) {
    return named && extend(certificate, issuer, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
           extend(certificate, issuer, NID_key_usage, "critical,keyCertSign,cRLSign") &&
           extend(certificate, issuer, NID_subject_key_identifier, "hash");
  }
  return named && extend(certificate, issuer, NID_basic_constraints, "critical,CA:FALSE") &&
         extend(certificate, issuer, NID_key_usage, "critical,digitalSignature") &&
         extend(certificate, issuer, NID_ext_key_usage,
                plan.use == CertificateUse::kServer ? "serverAuth" : "clientAuth") &&
         extend(certificate, issuer, NID_authority_key_identifier, "keyid");
}

// Sets a random serial number of at most 127 bits, the validity, the key, the names and the extensions of the
// certificate.
bool fill_in(X509* certificate, X509* issuer, EVP_PKEY* key, const CertificatePlan& plan) {
  constexpr int kSerialBits = 127;
  const BigNumber serial(BN_new());
  X509_NAME* const subject = X509_get_subject_name(certificate);
  const auto* name = reinterpret_cast<const unsigned char*>(plan.common_name.data());
  return serial && BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate)) != nullptr &&
         X509_set_version(certificate, X509_VERSION_3) == 1 &&
         X509_gmtime_adj(X509_getm_notBefore(certificate), -kSecondsBeforeNow) != nullptr &&
         X509_time_adj_ex(X509_getm_notAfter(certificate), plan.days, 0, nullptr) != nullptr &&
         X509_set_pubkey(certificate, key) == 1 &&
         X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, name, static_cast<int>(plan.common_name.size()), -1,
                                    0) == 1 &&
         X509_set_issuer_name(certificate, X509_get_subject_name(issuer)) == 1 &&
         extend_for_use(certificate, issuer, plan);
}

std::string text_of(BIO* memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory, &data);
  return std::string(data, static_cast<size_t>(size));
}

absl::StatusOr<CertificatePair> pem_of(X509* certificate, EVP_PKEY* key) {
  const Memory certificate_text(BIO_new(BIO_s_mem()));
  const Memory key_text(BIO_new(BIO_s_secmem()));
  if (!certificate_text || !key_text || PEM_write_bio_X509(certificate_text.get(), certificate) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return openssl_error();
  return CertificatePair{text_of(certificate_text.get()), text_of(key_text.get())};
}

Memory memory_of(const std::string& text) {
  return Memory(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

int refuse_password(char*, int, int, void*) { return -1; }

}  // namespace

absl::StatusOr<CertificatePair> make_certificate(const CertificatePlan& plan, const CertificatePair& authority) {
  RETURN_IF_ERROR(check_names(plan));
  const Key key(EVP_EC_gen("P-256"));
  const Certificate made(X509_new());
  if (!key || !made) return openssl_error();
  Certificate issuer;
  Key signer;
  if (plan.use != CertificateUse::kAuthority) {
    issuer.reset(PEM_read_bio_X509(memory_of(authority.certificate).get(), nullptr, nullptr, nullptr));
    signer.reset(PEM_read_bio_PrivateKey(memory_of(authority.key).get(), nullptr, &refuse_password, nullptr));
    const bool fits = issuer && signer && X509_check_private_key(issuer.get(), signer.get()) == 1;
    ERR_clear_error();
    if (!fits) return absl::InvalidArgumentError("the authority's certificate and key do not match");
  }
  X509* const issued_by = issuer ? issuer.get() : made.get();
  if (!fill_in(made.get(), issued_by, key.get(), plan) ||
      X509_sign(made.get(), signer ? signer.get() : key.get(), EVP_sha256()) == 0)
    return openssl_error();
  return pem_of(made.get(), key.get());
}

absl::Status write_certificate(const std::string& base, const CertificatePair& made) {
  const std::string key_file = absl::StrCat(base, ".key");
  RETURN_IF_ERROR(create_security_file(key_file, {made.key, kPrivateMode}));
  const absl::Status written = create_security_file(absl::StrCat(base, ".pem"), {made.certificate, kPublicMode});
  if (!written.ok()) ::unlink(key_file.c_str());
  return written;
}

absl::StatusOr<CertificatePair> read_certificate(const std::string& base) {
  ASSIGN_OR_RETURN(const SecurityFile certificate, read_security_file(absl::StrCat(base, ".pem")));
  ASSIGN_OR_RETURN(const SecurityFile key, read_security_file(absl::StrCat(base, ".key")));
  return CertificatePair{certificate.text, key.text};
}

}  // namespace locus::cli
