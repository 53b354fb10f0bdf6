// Encodes and decodes the topology of a mesh's tree (core/index/bvh/tree_topology.h) for the log. The bytes include the
// version of the tree builder. The bytes are the same for all instruction sets, because the trees are the same. Plain
// functions; any thread.
#ifndef LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/index/bvh/tree_topology.h"
#include "core/scene/log/byte_codec.h"

namespace locus {

// Returns the encoded topology.
std::string encode_topology(const TreeTopology& topology);

// Returns a topology that borrows from `bytes`. Returns DATA_LOSS if the bytes are damaged, and FAILED_PRECONDITION if
// another version of the tree builder made the topology. Does not check that the topology fits the mesh;
// TriangleBvh::restore() checks this.
absl::StatusOr<TreeTopology> decode_topology(const AlignedBytes& bytes);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
