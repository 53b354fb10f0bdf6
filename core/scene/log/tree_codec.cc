#include "core/scene/log/tree_codec.h"

#include "absl/strings/str_cat.h"

namespace locus {

std::string encode_topology(const TreeTopology& topology) {
  std::string bytes;
  // Reserve 64 bytes for the header, the column lengths and the padding.
  bytes.reserve(topology.numbers.size() * sizeof(uint32_t) + topology.block_sizes.size() +
                topology.nodes.size() * sizeof(TopologyNode) + 64);
  ByteWriter writer(bytes);
  write_kind(writer, BytesKind::kTreeTopology);
  writer.number(uint64_t{kBvhBuilderVersion});
  writer.column(topology.numbers);
  writer.column(absl::MakeConstSpan(topology.block_sizes));
  writer.column(absl::MakeConstSpan(topology.nodes));
  return bytes;
}

absl::StatusOr<TreeTopology> decode_topology(const AlignedBytes& bytes) {
  ByteReader reader(bytes.bytes());
  if (read_kind(reader) != BytesKind::kTreeTopology) reader.fail("the topology of a tree", "is of another kind");
  const uint64_t version = reader.number("the version of the builder");
  if (reader.good() && version != kBvhBuilderVersion)
    return absl::FailedPreconditionError(
        absl::StrCat("builder version ", version, " made the tree, the current version is ", kBvhBuilderVersion));
  TreeTopology topology;
  topology.numbers = reader.column<uint32_t>("the numbers of the triangles");
  const auto sizes = reader.column<uint8_t>("the sizes of the blocks");
  topology.block_sizes.assign(sizes.begin(), sizes.end());
  const auto nodes = reader.column<TopologyNode>("the nodes");
  topology.nodes.assign(nodes.begin(), nodes.end());
  reader.end("the topology of a tree");
  if (!reader.good()) return reader.status();
  return topology;
}

}  // namespace locus
