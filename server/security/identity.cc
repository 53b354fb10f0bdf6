#include "server/security/identity.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"
#include "server/security/security_limits.h"

namespace locus::server {
namespace {

absl::string_view prefix_of(IdentityKind kind) {
  switch (kind) {
    case IdentityKind::kAnonymous:
      break;
    case IdentityKind::kCertificate:
      return "cert:";
    case IdentityKind::kToken:
      return "token:";
    case IdentityKind::kJwt:
      return "jwt:";
    case IdentityKind::kUser:
      return "user:";
  }
  LOCUS_CHECK(false);
  return "";
}

}  // namespace

const IdentityPtr& anonymous_identity() {
  static const auto* const kIdentity = new IdentityPtr(std::make_shared<const Identity>());
  return *kIdentity;
}

absl::StatusOr<std::string> principal_of(IdentityKind kind, absl::string_view name) {
  if (name.empty()) return refuse_argument(Reason::kMalformed, "principal", {}, "the name is empty");
  std::string principal(prefix_of(kind));
  for (const char c : name) {
    const bool plain = absl::ascii_isgraph(static_cast<unsigned char>(c)) && c != '%' && c != '*' && c != '?';
    if (plain) {
      principal += c;
    } else {
      absl::StrAppend(&principal, "%", absl::Hex(static_cast<unsigned char>(c), absl::kZeroPad2));
    }
    if (principal.size() > kMaxPrincipalBytes)
      return refuse_limit("principal", "principal_bytes", kMaxPrincipalBytes, static_cast<double>(name.size()));
  }
  return principal;
}

}  // namespace locus::server
