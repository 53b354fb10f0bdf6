// Time until a mesh in a data directory can be queried again: its tree restored from the stored topology, compared with
// a new build. On two threads, like a daemon with two cores.
#ifndef LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
#define LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_

#include "absl/status/status.h"
#include "tests/bench/log/log_run.h"

namespace locus::bench::log {

absl::Status measure_mesh(const LogRun& run);

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
