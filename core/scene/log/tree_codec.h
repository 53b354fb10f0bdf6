// Encodes and decodes the topology of a mesh's tree (core/index/bvh/tree_topology.h) for the log, with the version of
// the builder. Trees, and so the bytes, are equal for all instruction sets. Plain functions; any thread.
#ifndef LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/index/bvh/tree_topology.h"
#include "core/scene/log/byte_codec.h"

namespace locus {

// Returns the bytes of a topology.
std::string encode_outline(const TreeTopology& topology);

// Returns a topology that borrows from `bytes`. DATA_LOSS describes damage; FAILED_PRECONDITION: the topology is from
// another version of the builder. Does not check that the topology fits the mesh: TriangleBvh::restore() does.
absl::StatusOr<TreeTopology> decode_outline(const AlignedBytes& bytes);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
