#include "tests/bench/frame/report.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace locus::bench {
void write_heading(std::ostream& out) {
  out << absl::StrFormat("%-36s %-20s %11s %11s %-14s %8s %7s  %s\n", "case", "peer", "ours", "peer's", "metric",
                         "ratio", "spread", "results")
      << std::flush;
}

void write_row(const Cell& cell, std::ostream& out) {
  out << absl::StrFormat("%-36s %-20s %11.4g %11.4g %-14s %8.3f %6.1f%%  %s\n", cell.case_name, cell.peer_name,
                         cell.ours, cell.peer, cell.metric, cell.ratio, 100 * cell.spread, cell.results_hash)
      << std::flush;
}

void write_closing(const Report& report, std::ostream& out) {
  out << "ratio: above 1 means ours is better; the median of "
      << "the rounds. Figures of time are for orientation.\n";
  for (const std::string& note : report.notes) out << "note: " << note << "\n";
  for (const std::string& disagreement : report.disagreements) out << "DISAGREEMENT: " << disagreement << "\n";
}

std::string json_of(const Report& report) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Cell& cell : report.cells) {
    list.push_back({{"suite", cell.suite},
                    {"case", cell.case_name},
                    {"metric", cell.metric},
                    {"ours", cell.ours},
                    {"peer", cell.peer},
                    {"peer_name", cell.peer_name},
                    {"ratio", cell.ratio},
                    {"spread", cell.spread},
                    {"results_hash", cell.results_hash}});
  }
  return list.dump(1) + "\n";
}

absl::Status write_json(const Report& report, const std::string& path) {
  std::ofstream file(path, std::ios::trunc);
  file << json_of(report);
  file.close();
  if (!file) return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder and space"));
  return absl::OkStatus();
}

int exit_status(const Report& report) { return report.disagreements.empty() ? 0 : 1; }

}  // namespace locus::bench
