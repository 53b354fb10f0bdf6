// Measures the time until a stored mesh of a data directory can be queried again. A tree that is restored from the
// stored topology is compared with a newly built tree. Uses two threads, like a daemon with two cores.
#ifndef LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
#define LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_

#include "absl/status/status.h"
#include "tests/bench/log/log_run.h"

namespace locus::bench::log {

absl::Status measure_mesh(const LogRun& run);

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
