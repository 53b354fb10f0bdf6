// Reads the files of TLS and checks them with the TLS library, so that a bad file is refused with a reason before it is
// used. Functions without state; any thread.
#ifndef LOCUS_SERVER_SECURITY_TLS_FILES_H_
#define LOCUS_SERVER_SECURITY_TLS_FILES_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace locus::server {

// Paths of the files.
struct TlsFiles {
  std::string certificate;  // the server's certificate, followed by its intermediate certificates
  std::string key;          // the key of the server's certificate, not encrypted
  std::string client_ca;    // CA certificates that sign client certificates; empty = clients need no certificate
};

// Contents of the files, in PEM.
struct TlsContents {
  std::string certificate;
  std::string key;
  std::string client_ca;
  friend bool operator==(const TlsContents&, const TlsContents&) = default;
};

inline constexpr size_t kMaxTlsFileBytes = size_t{4} << 20;

// Reads the files. If a file cannot be read or is too large, returns an error that names this file.
absl::StatusOr<TlsContents> read_tls_files(const TlsFiles& files);

// Returns OK if servers can use `contents`: the certificates and the key can be read, and the key belongs to the first
// certificate. Otherwise returns INVALID_ARGUMENT, which names the file and the reason.
absl::Status check_tls_contents(const TlsFiles& files, const TlsContents& contents);

// Returns warnings about contents that servers can use: certificates that have expired, are not yet valid, or are not
// followed by the certificate of their issuer.
std::vector<std::string> warnings_about(const TlsFiles& files, const TlsContents& contents);

// Returns the time, in seconds since 1970, at which the first certificate in `pem` has expired; 0 if there is no
// certificate that can be read.
int64_t certificate_end(const std::string& pem);

// Returns whether `before` has a certificate that `now` lacks. Both are certificates in PEM.
bool lacks_certificate(const std::string& before, const std::string& now);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_TLS_FILES_H_
