#include "tests/bench/plot/record.h"

#include <sched.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "tests/bench/frame/report.h"

namespace locus::bench {
namespace {

constexpr const char* kOutputOptions[] = {"--json", "--plot", "--progress", "--levels"};

bool is_output_option(const std::string& word) {
  return std::any_of(std::begin(kOutputOptions), std::end(kOutputOptions),
                     [&](const char* option) { return word == option; });
}

bool has_value_of_output_option(const std::string& word) {
  return std::any_of(std::begin(kOutputOptions), std::end(kOutputOptions),
                     [&](const char* option) { return absl::StartsWith(word, absl::StrCat(option, "=")); });
}

int usable_cores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
}

Cell cell_of(const nlohmann::json& json) {
  return {.suite = json.at("suite"),
          .case_name = json.at("case"),
          .metric = json.at("metric"),
          .ours = json.at("ours"),
          .peer = json.at("peer"),
          .peer_name = json.at("peer_name"),
          .ratio = json.at("ratio"),
          .spread = json.at("spread"),
          .results_hash = json.at("results_hash")};
}

}  // namespace

std::string date_of_today() { return absl::FormatTime("%Y-%m-%d", absl::Now(), absl::UTCTimeZone()); }

std::string name_of_machine() {
  std::ifstream file("/proc/cpuinfo");
  std::string processor = "unknown processor";
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (!absl::StartsWith(line, "model name") || colon == std::string::npos) continue;
    processor = line.substr(colon + 2);
    break;
  }
  const int cores = usable_cores();
  return absl::StrCat(processor, ", ", cores, cores == 1 ? " core" : " cores");
}

std::string recorded_arguments(const std::vector<std::string>& arguments) {
  std::vector<std::string> kept;
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (is_output_option(arguments[i])) {
      ++i;  // skips the value
    } else if (!has_value_of_output_option(arguments[i])) {
      kept.push_back(arguments[i]);
    }
  }
  return absl::StrJoin(kept, " ");
}

std::string json_of(const Record& record) {
  Report report;
  report.cells = record.cells;
  const nlohmann::ordered_json json = {{"date", record.date},
                                       {"machine", record.machine},
                                       {"arguments", record.arguments},
                                       {"cells", nlohmann::ordered_json::parse(json_of(report))}};
  return json.dump(1) + "\n";
}

absl::Status write_record(const Record& record, const std::string& path) {
  std::ofstream file(path, std::ios::trunc);
  file << json_of(record);
  file.close();
  if (!file) return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder and space"));
  return absl::OkStatus();
}

absl::StatusOr<Record> read_record(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  try {
    const nlohmann::json json = nlohmann::json::parse(text.str());
    Record record{
        .date = json.at("date"), .machine = json.at("machine"), .arguments = json.at("arguments"), .cells = {}};
    for (const nlohmann::json& cell : json.at("cells")) record.cells.push_back(cell_of(cell));
    const bool one_suite = std::all_of(record.cells.begin(), record.cells.end(),
                                       [&](const Cell& cell) { return cell.suite == record.cells.front().suite; });
    if (!record.cells.empty() && one_suite) return record;
    return absl::InvalidArgumentError(absl::StrCat(path, ": has no cells, or cells of several suites"));
  } catch (const nlohmann::json::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": is not a record of locus-bench --plot: ", error.what()));
  }
}

}  // namespace locus::bench
