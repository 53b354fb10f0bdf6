// Arguments of every case of the suite `log`. Plain data.
#ifndef LOCUS_TESTS_BENCH_LOG_LOG_RUN_H_
#define LOCUS_TESTS_BENCH_LOG_LOG_RUN_H_

#include <string>

#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/options.h"
#include "tests/bench/frame/report.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::log {

struct LogRun {
  const Options& options;
  const Progress& progress;
  Report& report;

  size_t chunks() const { return options.quick ? 1 : 4; }
};

inline Cell cell_of(const std::string& case_name, const char* metric, const ResultsHash& hash) {
  Cell cell;
  cell.suite = "log";
  cell.case_name = case_name;
  cell.metric = metric;
  cell.results_hash = hash.text();
  return cell;
}

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_LOG_RUN_H_
