// Functions that compute the figures of a cell from the rounds of a race, for every suite. Pure; inputs must not be
// empty.
#ifndef LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
#define LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_

#include <vector>

namespace locus::bench {

// Returns the middle value; of an even number of values, the mean of the two middle ones.
double median(std::vector<double> values);

// Returns the smallest value v such that at least the fraction `share` (0 ... 1) of all values is <= v.
double percentile(std::vector<double> values, double share);

// Returns (maximum - minimum) / median.
double spread(const std::vector<double>& values);

// Returns peer[i] / ours[i] for each round i. Both times were measured in the same round, so that other load disturbed
// both equally.
std::vector<double> round_ratios(const std::vector<double>& ours, const std::vector<double>& peer);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
