#include "tests/bench/serving/serving_suite.h"

#include "tests/bench/serving/crowd_cases.h"
#include "tests/bench/serving/durable_cases.h"
#include "tests/bench/serving/echo_cases.h"
#include "tests/bench/serving/ray_cases.h"
#include "tests/bench/serving/redis_cases.h"
#include "tests/bench/serving/scan_cases.h"
#include "tests/bench/serving/sight_cases.h"
#include "tests/bench/serving/step_cases.h"
#include "tests/bench/serving/tls_cases.h"

namespace locus::bench::serving {
absl::Status run_serving_suite(const Options& options, const Progress& progress, Report& report) {
  const ServingRun run{options, progress, report};
  // Must be started first: it forks, which requires that this process has one thread.
  absl::StatusOr<std::unique_ptr<RawTcpServer>> plain = nullptr;
  if (wants_raw_tcp(run)) plain = RawTcpServer::start();
  if (!plain.ok()) return plain.status();
  absl::Status status = run_ray_cases(run);
  if (status.ok() && *plain != nullptr) status = run_echo_cases(run, **plain);
  if (status.ok()) status = run_scan_cases(run);
  if (status.ok()) status = run_sight_cases(run);
  if (status.ok()) status = run_step_cases(run);
  if (status.ok()) status = run_redis_cases(run);
  if (status.ok()) status = run_crowd_cases(run);
  if (status.ok()) status = run_durable_cases(run);
  if (status.ok()) status = run_tls_cases(run);
  return status;
}

}  // namespace locus::bench::serving
