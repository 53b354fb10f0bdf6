// Until a mesh that a data directory holds can be asked again: its tree restored from the outline beside it, against
// built anew. On two threads, as a daemon with two cores does it.
#ifndef LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
#define LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_

#include "absl/status/status.h"
#include "tests/bench/log/log_run.h"

namespace locus::bench::log {

absl::Status measure_mesh(const LogRun& run);

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_MESH_CASE_H_
