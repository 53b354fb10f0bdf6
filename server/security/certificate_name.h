// Name in a client's certificate, by which grants identify the client. A pure function; any thread.
#ifndef LOCUS_SERVER_SECURITY_CERTIFICATE_NAME_H_
#define LOCUS_SERVER_SECURITY_CERTIFICATE_NAME_H_

#include <openssl/x509.h>

#include <string>

namespace locus::server {

// Returns the first URI among the alternative names, or else the first DNS name, or else the common name of the
// subject; an empty text if the certificate has none of these names. The gRPC port uses the same rule. Does not verify
// the certificate: the caller must have verified it.
std::string certificate_name(const X509& certificate);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_CERTIFICATE_NAME_H_
