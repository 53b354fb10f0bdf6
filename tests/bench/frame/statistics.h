// From the rounds of a race to the figures of a cell. Pure functions for every suite. Inputs are never empty.
#ifndef LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
#define LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_

#include <vector>

namespace locus::bench {

// The middle value, or the mean of the two in the middle.
double median(std::vector<double> values);

// The least value that at least that share (0 ... 1) of all do not exceed.
double percentile(std::vector<double> values, double share);

// The largest less the smallest, over the median.
double spread(const std::vector<double>& values);

// peer[i] / ours[i], round by round: both were measured side by side, so that what disturbs one disturbs the other.
std::vector<double> round_ratios(const std::vector<double>& ours, const std::vector<double>& peer);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_STATISTICS_H_
