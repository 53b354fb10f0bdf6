// Development certificates: an authority, and the certificates that it signs for servers and clients. Keys are on the
// curve P-256, signatures use SHA-256. For `locus cert`. Functions without state, which any thread may call.
#ifndef LOCUS_CLIENT_CLI_SECURITY_CERTIFICATES_H_
#define LOCUS_CLIENT_CLI_SECURITY_CERTIFICATES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace locus::cli {

// Certificate and its private key, both in PEM format.
struct CertificatePair {
  std::string certificate;
  std::string key;
};

enum class CertificateUse { kAuthority, kServer, kClient };

struct CertificatePlan {
  CertificateUse use = CertificateUse::kServer;
  std::string common_name;
  std::vector<std::string> dns_names = {};  // alternative names
  std::vector<std::string> addresses = {};  // alternative names: IPv4 or IPv6
  int days = 90;                            // validity from now
};

// Makes a key and a certificate for this key. The certificate is signed by `authority`. If the plan is for an
// authority, the certificate is signed by the new key itself, and `authority` is ignored. Returns INVALID_ARGUMENT for
// a malformed name or address, or if the authority's certificate and key do not match.
absl::StatusOr<CertificatePair> make_certificate(const CertificatePlan& plan, const CertificatePair& authority);

// Writes BASE.pem with mode 0644 and BASE.key with mode 0600. Returns ALREADY_EXISTS, without a change, if either file
// exists.
absl::Status write_certificate(const std::string& base, const CertificatePair& made);
// Reads BASE.pem and BASE.key.
absl::StatusOr<CertificatePair> read_certificate(const std::string& base);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SECURITY_CERTIFICATES_H_
