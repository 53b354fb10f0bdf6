// Output of a report: a table for people, which grows case by case, and JSON for other programs. Used by main.cc.
#ifndef LOCUS_TESTS_BENCH_FRAME_REPORT_H_
#define LOCUS_TESTS_BENCH_FRAME_REPORT_H_

#include <ostream>
#include <string>

#include "absl/status/status.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench {

// Writes the cells as a table: the heading, then one row per cell, flushed at once.
void write_heading(std::ostream& out);
void write_row(const Cell& cell, std::ostream& out);

// Writes the text below the rows: an explanation of the columns, the notes, then the disagreements.
void write_closing(const Report& report, std::ostream& out);

// Returns a list of objects {suite, case, metric, ours, peer, peer_name, ratio, spread, results_hash}.
std::string json_of(const Report& report);

// Writes the JSON; FAILED_PRECONDITION if the file cannot be written.
absl::Status write_json(const Report& report, const std::string& path);

// Returns 1 if the report has a disagreement, otherwise 0.
int exit_status(const Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_REPORT_H_
