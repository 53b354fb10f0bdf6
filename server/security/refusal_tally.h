// Limits the lines that refusals write to the audit log: each caller's first refusals in a window of time are written,
// the others are only counted, and one line says how many they were. So a stranger who is refused ten thousand times a
// second writes a few lines a second.
//
// One thread at a time. The window ends when its owner says so. Invariant: at most kMaxCallers callers are counted
// separately; the others share one count.
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
  static constexpr uint32_t kMaxLines = 4;   // lines of one caller in a window, and of all that share a count
  static constexpr size_t kMaxCallers = 64;  // callers with a count of their own in a window

  // Counts a refusal. Returns whether it is to be written. A caller is a principal at an address.
  bool count(const AuditEntry& refusal);

  // Ends the window. Returns an entry for each caller of whom refusals were not written, with their number.
  std::vector<AuditEntry> end_window();

 private:
  struct Caller {
    uint64_t refusals = 0;
    AuditEntry last;
  };

  absl::flat_hash_map<std::string, Caller> callers_;  // by principal and address; "" = all others
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_REFUSAL_TALLY_H_
