// Limits the number of lines about refusals in the audit log: the first refusals of each caller in a window of time are
// written, the others are only counted, and one line reports their number. So a stranger who is refused ten thousand
// times a second causes only a few lines a second.
//
// One thread at a time. The owner ends each window by end_window(). Invariant: at most kMaxCallers callers are counted
// separately; all further callers share one count.
#ifndef LOCUS_SERVER_SECURITY_REFUSAL_TALLY_H_
#define LOCUS_SERVER_SECURITY_REFUSAL_TALLY_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "server/security/audit_line.h"

namespace locus::server {

class RefusalTally {
 public:
  static constexpr uint32_t kMaxLines = 4;   // lines in a window for each caller's count and for the shared count
  static constexpr size_t kMaxCallers = 64;  // callers with a count of their own in a window

  // Counts a refusal. Returns whether the refusal must be written. A caller is a pair of principal and address.
  bool count(const AuditEntry& refusal);

  // Ends the window. For each count with refusals that were not written, returns an entry with their number.
  std::vector<AuditEntry> end_window();

 private:
  // Checks the invariant of the class comment. O(1).
  void check_invariants() const;
  struct Caller {
    uint64_t refusals = 0;
    AuditEntry last;
  };

  absl::flat_hash_map<std::string, Caller> callers_;  // by principal and address; "" = all others
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_REFUSAL_TALLY_H_
