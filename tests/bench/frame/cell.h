// Results of a benchmark: cells, each with a figure of locus and one of a peer, and notes about them. Used by every
// suite.
#ifndef LOCUS_TESTS_BENCH_FRAME_CELL_H_
#define LOCUS_TESTS_BENCH_FRAME_CELL_H_

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace locus::bench {

struct Cell {
  std::string suite;
  std::string case_name;
  std::string metric;  // unit of `ours` and `peer`, for example "ns/ray"; for information only
  double ours = 0;
  double peer = 0;
  std::string peer_name;
  double ratio = 0;   // median of the rounds' ratios; above 1 means locus is better
  double spread = 0;  // (maximum - minimum) / median of the rounds' ratios
  std::string results_hash;
};

struct Report {
  // Called with each cell as soon as it is added; may be empty.
  std::function<void(const Cell& cell)> on_cell;
  std::vector<Cell> cells;
  std::vector<std::string> notes;          // facts for the reader: a missing peer, rays that differ
  std::vector<std::string> disagreements;  // unexplained differences of results; if there is one, the exit status is 1

  void add(Cell cell) {
    if (on_cell) on_cell(cell);
    cells.push_back(std::move(cell));
  }
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_CELL_H_
