#include "server/host/memory_use.h"

#include <malloc.h>
#include <unistd.h>

#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace locus::server {
namespace {

// An object that is inserted or moved copies its cell and its way through the tree of ids.
constexpr uint64_t kBytesAnItem = 700;
constexpr uint64_t kBytesABatch = 16384;
// Columns grow by doubling while they come, ...
constexpr uint64_t kUploadTimesColumns = 3;
// ... then there are their copy by triangle, what building takes, the tree, and what is kept beside it.
constexpr uint64_t kBytesATriangle = 180;
constexpr uint64_t kBytesAnInstance = 1024;

uint64_t resident_bytes() {
  // Pages: of the whole address space, and those of it that are in memory.
  uint64_t mapped = 0;
  uint64_t resident = 0;
  std::ifstream("/proc/self/statm") >> mapped >> resident;
  const auto page = static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  return resident * page;
}

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
  for (const PlacementColumns& place : change.place) placed += place.count();
  return placed == 0 ? 0 : (statics.size() + placed) * kBytesAnInstance;
}

}  // namespace locus::server
