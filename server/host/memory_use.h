// Estimates of the memory that a piece of work needs, for the limit memory_bytes. An estimate is the peak memory of the
// work, measured on this version and rounded up. It need not be exact, because the memory of the whole process is
// measured repeatedly.
//
// Threads: every function may be called from any thread.
#ifndef LOCUS_SERVER_HOST_MEMORY_USE_H_
#define LOCUS_SERVER_HOST_MEMORY_USE_H_

#include <cstdint>

#include "core/scene/statics/static_mesh.h"
#include "core/scene/updates/update_batch.h"

namespace locus::server {

// Memory in bytes that applying a batch needs, and the kind of the batch by its effect on the memory of the scene.
struct UpdateCost {
  enum class Kind : uint8_t {
    kRemoves,  // the batch only removes objects
    kMoves,    // the batch changes objects, and inserts none
    kInserts,  // the batch inserts objects
  };
  uint64_t bytes = 0;
  Kind kind = Kind::kRemoves;
};
// Returns the number of the batch's items that insert, move or relabel an object, or remove one by its id, plus the
// number of parts of compounds that it inserts or gives new poses. The earlier messages of the batch are not counted,
// here and in cost_of(): they are counted when they arrive.
uint64_t item_count(const UpdateBatch& batch);
// Returns the cost of a batch whose form is not checked yet: its lists may have any length.
UpdateCost cost_of(const UpdateBatch& batch);

// Return the peak memory in bytes of an upload's columns, and of building the mesh's tree.
uint64_t upload_cost(uint32_t vertices, uint32_t triangles);
uint64_t tree_cost(uint32_t triangles);

// Returns the memory in bytes of a mesh's name and the names of its parts. Vertices and triangles are not included,
// because several mesh names may share them.
uint64_t parts_cost(absl::Span<const MeshPart> parts);

// Returns the peak memory in bytes of a change that places `placed` instances in a scene that has `present` instances:
// the peak from the check of the placements until the new set of instances is built. Returns 0 for a change without
// placements, which is never refused.
uint64_t change_cost(uint64_t present, uint64_t placed);

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_USE_H_
