// The cases in which readers query while a writer moves objects in scattered batches: concurrent_p50/1reader,
// concurrent_p99/1reader, concurrent_p999/1reader, concurrent_moves/3readers, concurrent_moves/3readers_below and
// unpaced/1reader. The cases use threads and wall time; the machine should have two idle cores.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CONCURRENT_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CONCURRENT_CASES_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

void run_concurrent_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CONCURRENT_CASES_H_
