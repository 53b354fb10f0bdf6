#include "tests/bench/plot/drawing.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/process.h"

namespace locus::bench {
namespace {

constexpr double kPatience = 60;  // seconds for one picture
constexpr double kPause = 0.01;
constexpr int kRowHeight = 18;
constexpr int kFrameHeight = 150;
constexpr int kPanelWidth = 620;
constexpr int kPanelHeight = 420;
constexpr size_t kMinCounts = 3;

// Returns `text` as a string of gnuplot.
std::string quoted(const std::string& text) { return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "''"}}), "'"); }

std::string heading_of(const Record& record) {
  return absl::StrCat("locus-bench ", record.arguments, "  (", record.date, "; ", record.machine, ")");
}

// Returns the lines that every script begins with. The background is white, so that the picture can be read on dark
// pages.
std::string opening(const std::string& title, int width, int height) {
  return absl::StrFormat(
      "set terminal svg noenhanced size %d,%d font 'sans-serif,12' background '#ffffff' name %s\n"
      "set encoding utf8\nset colorsequence podo\n",
      width, height, quoted(title));
}

// Names in the order in which they appear first.
class Names {
 public:
  // Returns the index of the name, which is added if it is new.
  size_t add(const std::string& name) {
    const size_t index = find(name);
    if (index == names_.size()) names_.push_back(name);
    return index;
  }
  // Returns the index of the name, or the number of names if it is not among them.
  size_t find(const std::string& name) const {
    return static_cast<size_t>(std::find(names_.begin(), names_.end(), name) - names_.begin());
  }
  const std::vector<std::string>& all() const { return names_; }

 private:
  std::vector<std::string> names_;
};

struct RatioRow {
  size_t peer;
  double ratio, low, high;
};

std::string script_of_rows(const Record& record, const std::vector<std::string>& cases,
                           const std::vector<std::vector<RatioRow>>& rows, const std::vector<std::string>& peers) {
  std::string script =
      opening(record.cells.front().suite, 1100, kFrameHeight + kRowHeight * static_cast<int>(cases.size()));
  absl::StrAppend(&script, "set title ", quoted(heading_of(record)), "\n",
                  "set xlabel 'ratio: right of 1 locus is better; a bar is as long as the spread of the rounds'\n",
                  "set logscale x 2\nset grid x\nset key outside bottom center horizontal\nset bars 0.4\n",
                  absl::StrFormat("set yrange [%d:-1]\nset offsets graph 0.02, graph 0.02, 0, 0\n", cases.size()),
                  "set arrow from 1, graph 0 to 1, graph 1 nohead linewidth 2 linecolor '#555555'\nset ytics (");
  std::vector<std::string> tics;
  for (size_t i = 0; i < cases.size(); ++i) tics.push_back(absl::StrCat(quoted(cases[i]), " ", i));
  absl::StrAppend(&script, absl::StrJoin(tics, ", "), ")\n");
  std::vector<std::string> plots;
  for (size_t peer = 0; peer < peers.size(); ++peer) {
    std::string data;
    for (size_t i = 0; i < rows.size(); ++i) {
      for (const RatioRow& row : rows[i]) {
        if (row.peer == peer) absl::StrAppendFormat(&data, "%.4g %.4g %.4g %d\n", row.ratio, row.low, row.high, i);
      }
    }
    if (data.empty()) continue;
    absl::StrAppend(&script, "$peer", peer, " << END\n", data, "END\n");
    plots.push_back(
        absl::StrFormat("$peer%d using 1:4:2:3 with xerrorbars linetype %d pointtype 7 pointsize 0.6 title %s", peer,
                        peer + 1, quoted(peers[peer])));
  }
  return absl::StrCat(script, "plot ", absl::StrJoin(plots, ", \\\n  "), "\n");
}

// Nanoseconds per query by number of values, for each structure.
using Panel = std::map<std::string, std::map<double, double>>;

struct Panels {
  Names titles;  // QUERY/SCENE
  Names structures;
  std::vector<Panel> panels;
};

// Collects the cells of times of queries, whose names are QUERY/STRUCTURE/SCENE/N.
Panels panels_of(const Record& record) {
  Panels found;
  for (const Cell& cell : record.cells) {
    const std::vector<std::string> parts = absl::StrSplit(cell.case_name, '/');
    double count = 0;
    if (cell.metric != "ns/query" || parts.size() != 4 || !absl::SimpleAtod(parts[3], &count)) continue;
    const size_t panel = found.titles.add(absl::StrCat(parts[0], "/", parts[2]));
    found.panels.resize(found.titles.all().size());
    found.structures.add(cell.peer_name);  // the list comes first
    found.structures.add(parts[1]);
    found.panels[panel][parts[1]][count] = cell.ours;
    // The list is measured in the same race as all structures, so its figure is the same in all cells.
    found.panels[panel][cell.peer_name][count] = cell.peer;
  }
  return found;
}

std::string data_of(const std::map<double, double>& line) {
  std::string data;
  for (const auto& [count, nanoseconds] : line) absl::StrAppendFormat(&data, "%.6g %.4g\n", count, nanoseconds);
  return data;
}

absl::Status run_gnuplot(const std::string& gnuplot, const TemporaryFolder& folder) {
  ASSIGN_OR_RETURN(std::unique_ptr<serving::Process> process,
                   serving::Process::start(gnuplot, {"gnuplot", folder.file("script")}, folder.file("log")));
  for (double waited = 0; !process->has_ended() && waited < kPatience; waited += kPause) serving::sleep_seconds(kPause);
  if (process->has_ended() && process->exit_code() == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("gnuplot failed: ", serving::text_of_file(folder.file("log"))));
}

}  // namespace

std::pair<double, double> spread_around(double ratio, double spread) {
  // The factor f solves f - 1/f = spread.
  const double factor = (spread + std::sqrt(spread * spread + 4)) / 2;
  return {ratio / factor, ratio * factor};
}

std::vector<Drawing> ratio_drawings(const Record& record) {
  Names cases, peers;
  std::vector<std::vector<RatioRow>> rows;
  for (const Cell& cell : record.cells) {
    if (cell.metric == "exponent" || !(cell.ratio > 0)) continue;
    const size_t row = cases.add(cell.case_name);
    rows.resize(cases.all().size());
    const auto [low, high] = spread_around(cell.ratio, cell.spread);
    rows[row].push_back({peers.add(cell.peer_name), cell.ratio, low, high});
  }
  std::vector<Drawing> drawings;
  for (size_t begin = 0; begin < rows.size(); begin += kMaxRows) {
    const auto from = static_cast<ptrdiff_t>(begin);
    const auto to = static_cast<ptrdiff_t>(std::min(rows.size(), begin + kMaxRows));
    const std::string number = begin == 0 ? "" : absl::StrCat("-", begin / kMaxRows + 1);
    drawings.push_back({absl::StrCat(record.cells.front().suite, "-ratios", number, ".svg"),
                        script_of_rows(record, {cases.all().begin() + from, cases.all().begin() + to},
                                       {rows.begin() + from, rows.begin() + to}, peers.all())});
  }
  return drawings;
}

std::vector<Drawing> growth_drawings(const Record& record) {
  const Panels found = panels_of(record);
  std::string plots;
  size_t count = 0;
  for (size_t i = 0; i < found.panels.size(); ++i) {
    const auto& panel = found.panels[i];
    const bool grows =
        std::any_of(panel.begin(), panel.end(), [](const auto& line) { return line.second.size() >= kMinCounts; });
    if (!grows) continue;
    ++count;
    std::vector<std::string> lines;
    for (const auto& [structure, line] : panel) {
      const size_t number = found.structures.find(structure);
      absl::StrAppend(&plots, "$data", i, "_", number, " << END\n", data_of(line), "END\n");
      lines.push_back(absl::StrFormat("$data%d_%d using 1:2 with linespoints linetype %d pointsize 0.5 title %s", i,
                                      number, number + 1, quoted(structure)));
    }
    absl::StrAppend(&plots, "set title ", quoted(found.titles.all()[i]), "\nplot ", absl::StrJoin(lines, ", \\\n  "),
                    "\n");
  }
  if (count == 0) return {};
  const int columns = count == 1 ? 1 : 2;
  const int lines = (static_cast<int>(count) + columns - 1) / columns;
  const std::string& suite = record.cells.front().suite;
  std::string script = opening(suite, columns * kPanelWidth, 40 + lines * kPanelHeight);
  absl::StrAppend(&script, "set logscale xy 10\nset format xy '%.0s%c'\nset grid\nset key outside right\n",
                  "set xlabel 'values'\nset ylabel 'ns a query'\n",
                  absl::StrFormat("set multiplot layout %d,%d title %s\n", lines, columns, quoted(heading_of(record))));
  return {{absl::StrCat(suite, "-growth.svg"), absl::StrCat(script, plots, "unset multiplot\n")}};
}

absl::StatusOr<std::string> find_gnuplot() {
  std::string path = serving::program_in_path("gnuplot");
  if (!path.empty()) return path;
  return absl::FailedPreconditionError("--plot needs the program gnuplot: install the package gnuplot-nox");
}

absl::StatusOr<std::vector<std::string>> draw(const Record& record, const std::string& gnuplot,
                                              const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::vector<Drawing> drawings = ratio_drawings(record);
  for (Drawing& drawing : growth_drawings(record)) drawings.push_back(std::move(drawing));
  std::vector<std::string> paths;
  for (const Drawing& drawing : drawings) {
    const TemporaryFolder temporary;
    std::ofstream(temporary.file("script")) << "set output " << quoted(temporary.file("svg")) << "\n" << drawing.script;
    RETURN_IF_ERROR(run_gnuplot(gnuplot, temporary));
    paths.push_back((std::filesystem::path(folder) / drawing.name).string());
    std::ofstream file(paths.back(), std::ios::trunc);
    file << serving::text_of_file(temporary.file("svg"));
    file.close();
    if (!file)
      return absl::FailedPreconditionError(absl::StrCat("cannot write ", paths.back(), ": check its folder and space"));
  }
  return paths;
}

}  // namespace locus::bench
