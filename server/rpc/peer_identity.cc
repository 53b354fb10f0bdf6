#include "server/rpc/peer_identity.h"

#include <grpc/grpc_security_constants.h>

#include <limits>
#include <memory>
#include <vector>

#include "server/security/tls_files.h"

namespace locus::server {

std::optional<std::string> certificate_name(const grpc::ServerContextBase& context) {
  const std::shared_ptr<const grpc::AuthContext> peer = context.auth_context();
  if (peer == nullptr || !peer->IsPeerAuthenticated()) return std::nullopt;
  for (const char* property : {GRPC_PEER_URI_PROPERTY_NAME, GRPC_PEER_DNS_PROPERTY_NAME, GRPC_X509_CN_PROPERTY_NAME}) {
    const std::vector<grpc::string_ref> values = peer->FindPropertyValues(property);
    if (!values.empty() && !values.front().empty()) return std::string(values.front().data(), values.front().size());
  }
  return std::nullopt;
}

int64_t peer_certificate_end(const grpc::ServerContextBase& context) {
  const std::shared_ptr<const grpc::AuthContext> peer = context.auth_context();
  if (peer == nullptr || !peer->IsPeerAuthenticated()) return std::numeric_limits<int64_t>::max();
  const std::vector<grpc::string_ref> certificate = peer->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (certificate.empty()) return std::numeric_limits<int64_t>::max();
  return certificate_end(std::string(certificate.front().data(), certificate.front().size()));
}

}  // namespace locus::server
