// Tables and sentences of `locus tune`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_TUNE_REPORT_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_TUNE_REPORT_H_

#include <string>
#include <vector>

#include "client/cli/extras/tune/cell_tuning.h"
#include "client/cli/extras/tune/structures/family.h"
#include "client/cli/output.h"

namespace locus::cli {

// Returns the sentence that says what to set, or to leave it.
std::string advice(const std::string& scene, const CellTuningResult& result);

// Returns the table of cell sizes: a row for each, with the cost of each kind and the time relative to the present.
Report cell_report(const std::string& scene, const CellTuningResult& result);

// Figures of the structures on one sort of values, such as "objects".
struct StructureTable {
  std::string values;
  uint64_t count = 0;
  std::vector<StructureFigures> figures;
};
Report structure_report(const std::string& scene, const std::vector<StructureTable>& tables);

// Returns the sentence that names the best structure for each kind.
std::string best_sentence(const StructureTable& table);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_TUNE_REPORT_H_
