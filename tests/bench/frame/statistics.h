// Statistics from the rounds of a race to the figures of a cell. Pure functions for every suite. Inputs are never
// empty.
#ifndef LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
#define LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_

#include <vector>

namespace locus::bench {

// Returns the middle value, or the mean of the two in the middle.
double median(std::vector<double> values);

// Returns the smallest value that at least that share (0 ... 1) of all values do not exceed.
double percentile(std::vector<double> values, double share);

// Returns (maximum - minimum) / median.
double spread(const std::vector<double>& values);

// Returns peer[i] / ours[i] for each round: both were measured side by side, so that other load disturbs both equally.
std::vector<double> round_ratios(const std::vector<double>& ours, const std::vector<double>& peer);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
