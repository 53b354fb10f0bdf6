#include "client/cli/extras/tune/tune_report.h"

#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/check.h"

namespace locus::cli {
namespace {

Json with_decimals(double number, int decimals) { return Json::parse(absl::StrFormat("%.*f", decimals, number)); }

// Returns all digits of a cell size, so that the server does not round it up to the next power of two.
std::string exact(double cell_size) { return absl::StrFormat("%.17g", cell_size); }

int percent(double value) { return static_cast<int>(std::lround(value)); }

}  // namespace

std::string advice(const std::string& scene, const CellTuningResult& result) {
  const SizeChoice& choice = result.choice;
  const SizeFigures& named = result.figures[choice.index];
  const std::string size = named.setting == 0
                               ? absl::StrCat("the size that the server chooses, ", exact(named.cell_size))
                               : exact(named.cell_size);
  if (!choice.leave_it)
    return absl::StrCat("set it: `locus scene update ", scene, " --cell-size ", exact(choice.cell_size),
                        "` makes these queries take ", percent(choice.gain_percent), " % less time");
  if (named.is_present || choice.gain_percent <= 0)
    return "leave it: no other cell size makes these queries clearly faster";
  return absl::StrCat("leave it: the best cell size, ", size, ", would save only ", percent(choice.gain_percent),
                      " % of the time");
}

Report cell_report(const std::string& scene, const CellTuningResult& result) {
  LOCUS_CHECK_LT(result.choice.index, result.figures.size());
  Report report;
  report.head["scene"] = scene;
  report.head["set"] = result.choice.leave_it ? Json(nullptr) : Json(result.choice.cell_size);
  report.head["gain_percent"] = with_decimals(result.choice.gain_percent, 1);
  report.rows_name = "sizes";
  for (size_t i = 0; i < result.figures.size(); ++i) {
    const SizeFigures& figures = result.figures[i];
    Json row = {{"cell_size", figures.cell_size},
                {"setting", figures.setting == 0 ? Json("chosen") : Json(figures.setting)},
                {"present", figures.is_present},
                {"build_ms", with_decimals(figures.build_ms, 1)},
                {"bytes", figures.bytes}};
    for (const auto& [kind, cost] : figures.kinds) {
      row[kind + "_ns"] = with_decimals(cost.nanoseconds, 0);
      row[kind + "_work"] = with_decimals(cost.work, 1);
    }
    row["time"] = with_decimals(figures.relative, 3);
    row["named"] = !result.choice.leave_it && i == result.choice.index;
    report.rows.push_back(std::move(row));
  }
  return report;
}

Report structure_report(const std::string& scene, const std::vector<StructureTable>& tables) {
  Report report;
  report.head["scene"] = scene;
  report.rows_name = "structures";
  for (const StructureTable& table : tables) {
    const std::map<std::string, std::string> best = best_structures(table.figures);
    report.head[table.values] = table.count;
    report.head["best_for_" + table.values] = Json(best);
    for (const StructureFigures& figures : table.figures) {
      Json row = {{"values", table.values},
                  {"structure", figures.name},
                  {"build_ms", with_decimals(figures.build_ms, 1)},
                  {"bytes", figures.bytes}};
      for (const auto& [kind, nanoseconds] : figures.nanoseconds) row[kind + "_ns"] = with_decimals(nanoseconds, 0);
      report.rows.push_back(std::move(row));
    }
  }
  return report;
}

std::string best_sentence(const StructureTable& table) {
  std::vector<std::string> parts;
  for (const auto& [kind, structure] : best_structures(table.figures))
    parts.push_back(absl::StrCat(structure, " for ", kind));
  return absl::StrCat("of ", table.count, " ", table.values, ", the best: ", absl::StrJoin(parts, ", "));
}

}  // namespace locus::cli
