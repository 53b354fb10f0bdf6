// Function that notes in a report whether a ratio reaches its required value. Used by suites that require ratios.
#ifndef LOCUS_TESTS_BENCH_FRAME_BAR_H_
#define LOCUS_TESTS_BENCH_FRAME_BAR_H_

#include <string>

#include "absl/strings/str_format.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench {

// Notes whether the ratio of the last added cell is at least `bar`. The text `how` follows `bar` in the note and
// explains how `bar` was computed; it may be empty.
inline void note_bar(Report& report, double bar, const std::string& how = "") {
  const Cell& cell = report.cells.back();
  report.notes.push_back(absl::StrFormat("%s beside %s: %.3f, required %.3f%s: %s", cell.case_name, cell.peer_name,
                                         cell.ratio, bar, how, cell.ratio >= bar ? "shown" : "MISSED"));
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_BAR_H_
