#include "server/host/memory_use.h"

#include <malloc.h>

#include <limits>
#include <string>
#include <vector>

#include "server/observability/process_figures.h"

namespace locus::server {
namespace {

// Peak bytes for each item of a batch: inserting or moving an object copies its cell and its path in the tree of ids.
constexpr uint64_t kBytesAnItem = 700;
constexpr uint64_t kBytesABatch = 16384;
// Peak memory of an upload's columns, as a multiple of their size: they grow by doubling while they arrive.
constexpr uint64_t kUploadTimesColumns = 3;
// Peak bytes for each triangle while the tree is built: the copy ordered by triangle, temporary memory, the tree and
// its additional data.
constexpr uint64_t kBytesATriangle = 180;
constexpr uint64_t kBytesAnInstance = 1024;

}  // namespace

MemoryBudget::Meter process_memory(const Registry& registry) {
  const auto release_memory = [&registry] {
    for (const ScenePtr& scene : registry.list_scenes("", std::numeric_limits<size_t>::max())) scene->forget_recent();
    malloc_trim(0);
  };
  return {resident_bytes, release_memory};
}

UpdateCost cost_of(const UpdateBatch& batch) {
  UpdateCost cost;
  uint64_t items = 0;
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size();
  cost.inserts = items > 0;
  for (const MoveColumns& move : batch.moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.relabels) items += relabel.ids.size();
  cost.bytes = kBytesABatch + items * kBytesAnItem;
  return cost;
}

uint64_t upload_cost(uint32_t vertices, uint32_t triangles) {
  const uint64_t columns = 3 * sizeof(float) * uint64_t{vertices} + 3 * sizeof(uint32_t) * uint64_t{triangles};
  return columns * kUploadTimesColumns + triangles * kBytesATriangle;
}

uint64_t change_cost(const StaticSet& statics, const StaticChange& change) {
  uint64_t placed = 0;
  for (const PlacementColumns& placement : change.place) placed += placement.count();
  return placed == 0 ? 0 : (statics.size() + placed) * kBytesAnInstance;
}

}  // namespace locus::server
