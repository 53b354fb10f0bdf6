// The suite structures: every structure of core/index on the same boxes, compared with the list, which tests every
// box. Case names are QUERY/STRUCTURE/SCENE/N.
#ifndef LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURES_SUITE_H_
#define LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURES_SUITE_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::structures {

absl::Status run_structures_suite(const Options& options, const Progress& progress, Report& report);

// Returns the slope of the line through the points (log counts[i], log values[i]) with the least sum of squared
// differences: the exponent of the power law that fits best. At least two different counts; all numbers are above zero.
double exponent_of(const std::vector<double>& counts, const std::vector<double>& values);

// Returns the largest count at which the ratios rise to 1 or above, interpolated on logarithmic axes; 0 if they do so
// nowhere. Counts are ascending; all numbers are above zero.
double crossing_of(const std::vector<double>& counts, const std::vector<double>& ratios);

}  // namespace locus::bench::structures

#endif  // LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURES_SUITE_H_
