// Pictures of a record as SVG, drawn by gnuplot: ratios with their spread for every suite, and for the suite structures
// also the time of a query against the number of values. Used by main.cc. The scripts are pure functions of the record,
// so the same record results in the same picture.
#ifndef LOCUS_TESTS_BENCH_PLOT_DRAWING_H_
#define LOCUS_TESTS_BENCH_PLOT_DRAWING_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tests/bench/plot/record.h"

namespace locus::bench {

struct Drawing {
  std::string name;    // of the SVG file
  std::string script;  // for gnuplot, without the line that names the file
};

inline constexpr size_t kMaxRows = 60;  // cases in one picture of ratios; further cases are in further pictures

// Returns the ends of an interval around `ratio` that is (end - begin) / ratio = `spread` long and symmetric on a
// logarithmic axis. A cell has no more than the length: the rounds' smallest and largest ratios are not known.
std::pair<double, double> spread_around(double ratio, double spread);

// Returns the pictures of ratios: a row for each case, a colour for each peer. Exponents have no ratio to draw.
std::vector<Drawing> ratio_drawings(const Record& record);

// Returns the picture of nanoseconds per query against the number of values, both logarithmic: a panel for each query
// of a scene with three counts or more, a line for each structure and one for the list. Empty if there are none.
std::vector<Drawing> growth_drawings(const Record& record);

// Returns the path of gnuplot. Returns FAILED_PRECONDITION with the name of its package if it is not in the PATH.
absl::StatusOr<std::string> find_gnuplot();

// Writes all pictures of the record to the folder, which is created if it is missing. Returns the paths.
absl::StatusOr<std::vector<std::string>> draw(const Record& record, const std::string& gnuplot,
                                              const std::string& folder);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_PLOT_DRAWING_H_
