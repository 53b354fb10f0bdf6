// The outline of a mesh's tree (core/index/bvh/tree_topology.h) as bytes for the log, with the version of the builder
// that made it. The same for all instruction sets, as trees are. Free functions; any thread.
#ifndef LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/index/bvh/tree_topology.h"
#include "core/scene/log/byte_codec.h"

namespace locus {

std::string encode_outline(const TreeTopology& topology);

// Borrows from `bytes`. DATA_LOSS saying what is wrong with them, FAILED_PRECONDITION for another builder's.
absl::StatusOr<TreeTopology> decode_outline(const AlignedBytes& bytes);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_TREE_CODEC_H_
