#include "client/cli/rows/update_report.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {

std::string applied_text(uint64_t applied, const v1::UpdateAck& ack) {
  return absl::StrCat(applied, " applied, revision ", ack.revision(), ", tick ", ack.tick());
}

absl::Status apply_and_report(const std::string& scene, v1::UpdateBatch batch, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::UpdateAck ack, client->apply(scene, std::move(batch)));
  context.remember_own(scene, {ack.epoch(), ack.revision()});
  Report report;
  report.head = {{"applied", ack.applied()},
                 {"refused", ack.refused()},
                 {"revision", ack.revision()},
                 {"tick", ack.tick()},
                 {"epoch", id_json(ack.epoch())}};
  if (ack.errors_size() > 0) report.rows_name = "errors";
  for (const v1::ItemError& error : ack.errors()) {
    report.rows.push_back({{"field", error.field()},
                           {"index", error.index()},
                           {"id", id_json(error.id())},
                           {"reason", std::string(absl::StripPrefix(v1::Reason_Name(error.reason()), "REASON_"))}});
  }
  if (report.rows_name.empty()) {
    context.acknowledge(report, applied_text(ack.applied(), ack));
  } else {
    context.write(report);
  }
  return refused_items(ack);
}

}  // namespace locus::cli
