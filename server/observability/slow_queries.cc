#include "server/observability/slow_queries.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "server/observability/log.h"

namespace locus::server {

void SlowQueries::record(const SlowQuery& query, Time now) {
  count_.fetch_add(1);
  const std::optional<uint64_t> left_out = lines_.admit(now);
  if (!left_out) return;
  constexpr uint64_t kNanosecondsAMs = 1'000'000;
  log(LogLevel::kWarning, "slow queries",
      {{"rpc", std::string(query.rpc)},
       {"scene", query.scene},
       {"revision", absl::StrCat(query.revision)},
       {"kinds", query.kinds},
       {"queries", absl::StrCat(query.queries)},
       {"ms", absl::StrCat(query.nanoseconds / kNanosecondsAMs)},
       {"work_ms", absl::StrCat(query.work_nanoseconds / kNanosecondsAMs)},
       {"nodes", absl::StrCat(query.work.nodes)},
       {"cells", absl::StrCat(query.work.cells)},
       {"tests", absl::StrCat(query.work.tests)},
       {"left_out", absl::StrCat(*left_out)}});
}

}  // namespace locus::server
