// How a report is written: a table to read, which grows case by case, and the JSON that other programs read. For
// main.cc.
#ifndef LOCUS_TESTS_BENCH_FRAME_REPORT_H_
#define LOCUS_TESTS_BENCH_FRAME_REPORT_H_

#include <ostream>
#include <string>

#include "absl/status/status.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench {

// The cells in columns: their names first, then a row for each, at once in the hands of whoever reads.
void write_heading(std::ostream& out);
void write_row(const Cell& cell, std::ostream& out);

// What stands below the rows: how to read them, the notes, then the disagreements.
void write_closing(const Report& report, std::ostream& out);

// A list of objects {suite, case, metric, ours, peer, peer_name, ratio, spread, results_hash}.
std::string json_of(const Report& report);

// FAILED_PRECONDITION where the file cannot be written.
absl::Status write_json(const Report& report, const std::string& path);

// 1 if anything disagrees, else 0.
int exit_status(const Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_REPORT_H_
