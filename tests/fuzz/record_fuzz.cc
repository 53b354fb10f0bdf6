// Records of a scene's log: an accepted record is encoded, and its encoding is decoded and encoded again to equal
// bytes.
#include <memory>
#include <variant>

#include "core/scene/log/record_codec.h"
#include "core/scene/updates/update_batch.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::fuzz {
namespace {

std::string encode_again(const UpdateBatch& batch) {
  LOCUS_CHECK(check_form(batch).ok());
  std::string bytes;
  encode_batch(batch, bytes);
  return bytes;
}

std::string encode_again(const Record::Joined& joined) {
  std::vector<const UpdateBatch*> batches;
  for (const UpdateBatch& batch : joined.batches) {
    LOCUS_CHECK(may_join(joined.batches.front(), batch));
    batches.push_back(&batch);
  }
  std::string bytes;
  encode_joined(batches, bytes);
  return bytes;
}

// Returns a mesh with the key of a placement, since the encoder reads the key from the mesh.
std::shared_ptr<const StaticMesh> mesh_of(const MeshKey& key) {
  auto mesh = TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {});
  return *StaticMesh::build(key.name, key.sha256, *std::move(mesh));
}

std::string encode_again(const Record::Change& read) {
  LOCUS_CHECK_EQ(read.meshes.size(), read.change.place.size());
  StaticChange change = read.change;
  std::vector<Id> ids;
  for (size_t i = 0; i < change.place.size(); ++i) {
    change.place[i].mesh = mesh_of(read.meshes[i]);
    const size_t count = change.place[i].count();
    // Skip a change whose columns have different lengths: it is never encoded, because StaticSet::apply() refuses it.
    if (change.place[i].ids.size() != count) return "";
    ids.insert(ids.end(), change.place[i].ids.begin(), change.place[i].ids.end());
  }
  std::string bytes;
  encode_change(change, ids, bytes);
  return bytes;
}

LOCUS_FUZZ_TARGET(record) {
  const absl::StatusOr<Record> record = Record::decode(input);
  if (!record.ok()) return check_error(record.status());
  const auto encode = [](const Record& one) {
    return std::visit([](const auto& content) { return encode_again(content); }, one.content());
  };
  const std::string bytes = encode(*record);
  if (bytes.empty()) return;
  const absl::StatusOr<Record> again = Record::decode(bytes);
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(encode(*again) == bytes);
}

}  // namespace
}  // namespace locus::fuzz
