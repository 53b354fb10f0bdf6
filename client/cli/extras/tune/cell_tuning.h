// Measurement of cell sizes for a scene: makes scratch scenes, asks them the queries in turns, and chooses. For `locus
// tune`. A function without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_TUNING_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_TUNING_H_

#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/tune/cell_choice.h"
#include "client/cli/extras/tune/object_batches.h"
#include "client/cli/extras/tune/query_set.h"
#include "client/cli/extras/tune/room_check.h"
#include "client/lib/client.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

// Weights of the kinds of query: by the number of their queries, or each alike.
enum class Mix { kAsAsked, kAlike };

struct CellTuningOptions {
  std::vector<double> sizes;  // measure exactly these powers of two, beside the present size and the server's choice
  int rounds = 7;
  Mix mix = Mix::kAlike;
};

struct CellTuningResult {
  std::vector<SizeFigures> figures;  // ascending by cell size; the server's choice first among equal ones
  SizeChoice choice;
};

// Returns what the scratch scenes that exist at the same time need, of a scene with this description.
ScratchNeed scratch_need(const v1::GetSceneResponse& scene, const CellTuningOptions& options);

// Measures and chooses. `work` makes calls that may be cancelled, `cleaner` deletes the scratch scenes, all of which
// are gone when the function returns. Without options.sizes, searches by next_exponents(). Every size is measured in
// turns with the present one; at the end the best is measured again. Precondition: the scene has objects.
absl::StatusOr<CellTuningResult> tune_cells(const client::Client& work, const client::Client& cleaner,
                                            const v1::GetSceneResponse& scene, const ObjectBatches& objects,
                                            const QuerySet& queries, const CellTuningOptions& options,
                                            ProgressWriter& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_TUNING_H_
