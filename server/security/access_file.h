// Rules that define who may do what, read from the access file. Immutable after parsing; any thread.
//
// The access file is text. `#` at the beginning of a line or of a word begins a comment. Each line is one of
//   grant PRINCIPAL RIGHT[,RIGHT...] [SCENE-PATTERN...]    grant token:ci read,update arena-* lobby
//   quota PRINCIPAL NAME=VALUE...                          quota token:* queries_per_s=50000 open_streams=16
// PRINCIPAL is the text of a principal, in which `*` and `?` are wildcards. In a quota, PRINCIPAL may also be
// `connection:*`, which means each connection. Rights to scenes (read, update, admin) need scene patterns, rights to
// the server have none; the names are in rights.h and quota.h. Calls that no line grants are refused. If several lines
// set the same quota for a caller, the last line counts. Connections can have only quotas of rates, bytes_in_flight and
// open_streams. `burst_s=SECONDS` says for how many seconds an unused rate is saved up; the saved amount may be used in
// one burst.
#ifndef LOCUS_SERVER_SECURITY_ACCESS_FILE_H_
#define LOCUS_SERVER_SECURITY_ACCESS_FILE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/security/identity.h"
#include "server/security/quota.h"
#include "server/security/rights.h"

namespace locus::server {

class AccessRules {
 public:
  // Makes rules that grant nothing.
  AccessRules() = default;

  // Parses the text of an access file; `file` is its name in errors. Returns INVALID_ARGUMENT, naming the line and the
  // mistake, with advice on the correction.
  static absl::StatusOr<AccessRules> parse(absl::string_view file, absl::string_view text);
  // Makes rules that grant everything to everybody.
  static AccessRules all_allowed();
  // Makes rules that grant everything to callers with a token, JWT or certificate.
  static AccessRules verified_allowed();

  // Returns whether the identity has a right. `scene` is the name of the scene for rights to scenes, else ignored.
  // Takes 0.1 us with a few grants; never allocates.
  bool allows(const Identity& identity, Right right, absl::string_view scene) const;
  bool allows(const Identity& identity, Right right) const { return allows(identity, right, {}); }
  // Returns whether the identity has a right to every scene, by a grant with the pattern `*`.
  bool allows_all(const Identity& identity, Right right) const;
  // Returns whether any grant gives the identity this right. For a right to scenes, the patterns of the grant need not
  // match an existing scene.
  bool allows_any(const Identity& identity, Right right) const;
  // Returns whether the identity has any right at all.
  bool knows(const Identity& identity) const;

  // Returns the quota of a subject: the principal of an identity, or `connection:PEER` for a connection. Patterns match
  // connections only if they begin with `connection:`.
  Quota quota_of(absl::string_view subject) const;
  Quota quota_of(const Identity& identity) const { return quota_of(identity.principal); }
  // Returns whether there is any quota.
  bool has_quotas() const { return !quotas_.empty(); }

 private:
  friend class AccessParser;
  struct Grant {
    std::string principal;
    uint32_t rights = 0;  // bit set of Right, with included rights
    std::vector<std::string> scenes;
  };
  struct QuotaLine {
    std::string subject;
    std::vector<std::pair<QuotaKind, double>> limits;
    double burst_s = 0;  // 0 = not set
  };

  // Calls `visit` with each grant of a principal until `visit` returns true. Returns whether a call returned true.
  template <class Visit>
  bool any_grant(absl::string_view principal, const Visit& visit) const;
  void add(Grant grant);

  std::vector<Grant> glob_grants_;                                     // grants to patterns of principals
  absl::flat_hash_map<std::string, std::vector<Grant>> exact_grants_;  // grants to one principal, by its text
  std::vector<QuotaLine> quotas_;                                      // in the order of the file
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_ACCESS_FILE_H_
