// Lines of the audit log. Pure functions; any thread.
#ifndef LOCUS_SERVER_SECURITY_AUDIT_LINE_H_
#define LOCUS_SERVER_SECURITY_AUDIT_LINE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::server {

struct AuditEntry {
  int64_t unix_ms = 0;    // milliseconds since 1970
  std::string principal;  // identity of the caller, such as token:ci
  // Peer::label of the connection; an address if the entry stands for several connections or refusals.
  std::string peer;
  // Peer::limit_key of the connection. Refusals are counted by principal and `address`. A line that reports counted
  // refusals has `address` as its peer; other lines do not use `address`.
  std::string address;
  std::string rpc;      // full method path, HTTP page, or event of the server: connect, reload, end_lease
  std::string subject;  // scene or mesh; empty = none
  absl::StatusCode code = absl::StatusCode::kOk;
  std::string request_id;  // request id of the call; empty = none
  std::string text;        // what was changed, or why it was refused
};

// Returns the line of an entry, with its final newline: a JSON object in ASCII with the members time (RFC 3339, UTC),
// principal, peer, rpc, subject, code, request_id and text. Texts longer than kMaxAuditTextBytes are cut.
std::string audit_line(const AuditEntry& entry);

// Returns a JSON string in ASCII, with its quotation marks. Control characters and characters beyond ASCII are escaped;
// U+FFFD stands for each byte that is not UTF-8.
std::string json_string(absl::string_view text);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_AUDIT_LINE_H_
