#include "server/security/refusal_tally.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"

namespace locus::server {

bool RefusalTally::count(const AuditEntry& refusal) {
  std::string key = absl::StrCat(refusal.principal, " ", refusal.address);
  if (callers_.size() >= kMaxCallers && !callers_.contains(key)) key.clear();
  Caller& caller = callers_[key];
  caller.last = refusal;
  if (key.empty()) {
    caller.last.principal = "others";
    caller.last.address.clear();
  }
  LOCUS_DCHECK_CALL(check_invariants());
  return ++caller.refusals <= kMaxLines;
}

void RefusalTally::check_invariants() const {
  LOCUS_CHECK_LE(callers_.size(), callers_.contains("") ? kMaxCallers + 1 : kMaxCallers);
}

std::vector<AuditEntry> RefusalTally::end_window() {
  std::vector<AuditEntry> notes;
  for (auto& [key, caller] : callers_) {
    if (caller.refusals <= kMaxLines) continue;
    AuditEntry& note = notes.emplace_back(std::move(caller.last));
    note.peer = note.address;
    note.subject.clear();
    note.request_id.clear();
    note.text =
        absl::StrCat(caller.refusals - kMaxLines, " more refusals were not written, the last of them: ", note.text);
  }
  callers_.clear();
  LOCUS_DCHECK_CALL(check_invariants());
  return notes;
}

}  // namespace locus::server
