// Record of a run of `locus-bench`: its cells with the date, the machine and the arguments, as JSON. Pictures are drawn
// from records, so that committed results can be drawn again without measuring again. Used by main.cc.
#ifndef LOCUS_TESTS_BENCH_PLOT_RECORD_H_
#define LOCUS_TESTS_BENCH_PLOT_RECORD_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench {

struct Record {
  std::string date;       // of the run, UTC: 2026-01-31
  std::string machine;    // processor and number of cores
  std::string arguments;  // of locus-bench, without those that only say where output goes
  std::vector<Cell> cells;
};

// Returns the date of today and the name of this machine's processor with the number of cores this process may use.
std::string date_of_today();
std::string name_of_machine();

// Returns the arguments of the run without --json, --plot, --progress and --levels and their values.
std::string recorded_arguments(const std::vector<std::string>& arguments);

std::string json_of(const Record& record);
absl::Status write_record(const Record& record, const std::string& path);

// Returns the record in the file `path`. Returns NOT_FOUND if the file cannot be read, INVALID_ARGUMENT if it is not a
// record with at least one cell, all of one suite.
absl::StatusOr<Record> read_record(const std::string& path);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_PLOT_RECORD_H_
