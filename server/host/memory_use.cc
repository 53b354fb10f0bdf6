#include "server/host/memory_use.h"

#include <string>
#include <vector>

namespace locus::server {
namespace {

// Peak bytes for each item of a batch: inserting or moving an object copies its cell and its path in the tree of ids.
constexpr uint64_t kBytesAnItem = 700;
constexpr uint64_t kBytesACompoundPart = 160;  // peak bytes for each part of a new compound
constexpr uint64_t kBytesABatch = 16384;
// Peak memory of an upload's columns, as a multiple of their final size: the vectors of the columns double their
// capacity as they grow.
constexpr uint64_t kUploadTimesColumns = 3;
// Peak bytes for each triangle while a mesh's tree is built: a copy of the mesh in the order of its triangles,
// temporary memory, the tree, and data that is stored with the tree.
constexpr uint64_t kBytesATriangle = 180;
constexpr uint64_t kBytesAPart = 64;  // memory of a mesh part without its name
constexpr uint64_t kBytesAMeshName = 1024;
constexpr uint64_t kBytesAnInstance = 1024;

uint64_t inserted_count(const UpdateBatch& batch) {
  uint64_t items = 0;
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size();
  return items;
}

uint64_t changed_count(const UpdateBatch& batch) {
  uint64_t items = 0;
  for (const MoveColumns& move : batch.moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.relabels) items += relabel.ids.size();
  return items;
}

// Returns the number of parts of the compounds that the batch makes: one compound for each insertion of compounds, and
// one for each object whose parts get new poses.
uint64_t made_parts(const UpdateBatch& batch) {
  uint64_t parts = 0;
  for (const InsertColumns& insert : batch.inserts) parts += part_count(insert);
  for (const MoveColumns& move : batch.moves) parts += part_count(move);
  return parts;
}

uint64_t changed_instances(const UpdateBatch& batch) {
  uint64_t items = 0;
  for (const InstanceMoveColumns& move : batch.instance_moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.instance_relabels) items += relabel.ids.size();
  return items;
}

}  // namespace

uint64_t item_count(const UpdateBatch& batch) {
  return inserted_count(batch) + changed_count(batch) + changed_instances(batch) + batch.remove_ids.size() +
         made_parts(batch);
}

UpdateCost cost_of(const UpdateBatch& batch) {
  UpdateCost cost;
  const uint64_t inserts = inserted_count(batch), changes = changed_count(batch), instances = changed_instances(batch);
  cost.kind = inserts > 0               ? UpdateCost::Kind::kInserts
              : changes + instances > 0 ? UpdateCost::Kind::kMoves
                                        : UpdateCost::Kind::kRemoves;
  cost.bytes = kBytesABatch + (inserts + changes) * kBytesAnItem + made_parts(batch) * kBytesACompoundPart +
               instances * kBytesAnInstance;
  return cost;
}

uint64_t upload_cost(uint32_t vertices, uint32_t triangles) {
  const uint64_t columns = 3 * sizeof(float) * uint64_t{vertices} + 3 * sizeof(uint32_t) * uint64_t{triangles};
  return columns * kUploadTimesColumns;
}

uint64_t tree_cost(uint32_t triangles) { return uint64_t{triangles} * kBytesATriangle; }

uint64_t parts_cost(absl::Span<const MeshPart> parts) {
  uint64_t bytes = kBytesAMeshName;
  for (const MeshPart& part : parts) bytes += kBytesAPart + part.name.size();
  return bytes;
}

uint64_t change_cost(uint64_t present, uint64_t placed) {
  return placed == 0 ? 0 : (present + placed) * kBytesAnInstance;
}

}  // namespace locus::server
