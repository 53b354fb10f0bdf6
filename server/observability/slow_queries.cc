#include "server/observability/slow_queries.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "server/config/observability_limits.h"
#include "server/observability/log.h"

namespace locus::server {

void SlowQueries::record(const SlowQuery& query, Time now) {
  count_.fetch_add(1);
  uint64_t left_out = 0;
  {
    const MutexLock lock(mutex_);
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      lines_ = 0;
    }
    if (lines_ >= kMaxSlowQueryLines) {
      ++left_out_;
      return;
    }
    ++lines_;
    LOCUS_DCHECK_LE(lines_, kMaxSlowQueryLines);
    left_out = std::exchange(left_out_, 0);
  }
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
       {"left_out", absl::StrCat(left_out)}});
}

}  // namespace locus::server
