// Fixture with a scene. Its short functions check refusals, and change the scene by batches and placements that are
// written as literals.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_FIXTURE_H_
#define LOCUS_TESTS_SUPPORT_SCENE_FIXTURE_H_

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"
#include "gtest/gtest.h"
#include "tests/support/columns.h"

namespace locus::test {

// Checks the status code, and the reason, field and index of the refusal.
inline void expect_refusal(const absl::Status& status, absl::StatusCode code, Reason reason, const std::string& field,
                           std::optional<uint32_t> index = {}) {
  EXPECT_EQ(status.code(), code) << status;
  const Refusal refusal = refusal_of(status).value_or(Refusal{});
  EXPECT_EQ(refusal.reason, reason) << status;
  EXPECT_EQ(refusal.field, field) << status;
  EXPECT_EQ(refusal.index, index) << status;
}

inline std::shared_ptr<const StaticMesh> make_mesh(const std::string& name, uint8_t content,
                                                   std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0}) {
  Sha256 sha256{};
  sha256[0] = content;
  return *StaticMesh::build(name, sha256, *TriangleMesh::create(std::move(vertices), {0, 1, 2}, {}));
}

class SceneFixture : public ::testing::Test {
 protected:
  static constexpr uint64_t kEpoch = 77;

  SceneFixture() : SceneFixture(SceneSpec()) {}
  explicit SceneFixture(const SceneSpec& spec) : scene_("scene", spec, kEpoch, StaticSet::empty()) {}

  MoveColumns move_to(std::vector<Id> ids, std::vector<float> positions) {
    MoveColumns move;
    move.ids = columns_.ids(std::move(ids));
    move.positions = columns_.floats(std::move(positions));
    return move;
  }

  InsertColumns points(std::vector<Id> ids, std::vector<float> positions) {
    InsertColumns insert;
    insert.ids = columns_.ids(std::move(ids));
    insert.positions = columns_.floats(std::move(positions));
    return insert;
  }

  InsertColumns balls(std::vector<Id> ids, std::vector<float> radii) {
    InsertColumns insert = points(std::move(ids), {0, 0, 0});
    insert.kind = ShapeKind::kBall;
    insert.radii = columns_.floats(std::move(radii));
    return insert;
  }

  // Returns compounds at the origin whose parts are balls.
  InsertColumns compounds(std::vector<Id> ids, std::vector<float> part_positions, std::vector<float> radii) {
    InsertColumns insert = points(std::move(ids), {0, 0, 0});
    insert.kind = ShapeKind::kCompound;
    PartColumns& parts = insert.parts.emplace_back();
    parts.positions = columns_.floats(std::move(part_positions));
    parts.radii = columns_.floats(std::move(radii));
    return insert;
  }

  static UpdateBatch with(InsertColumns insert) {
    UpdateBatch batch;
    batch.inserts.push_back(insert);
    return batch;
  }
  static UpdateBatch with(MoveColumns move) {
    UpdateBatch batch;
    batch.moves.push_back(move);
    return batch;
  }
  static UpdateBatch with(RelabelColumns relabel) {
    UpdateBatch batch;
    batch.relabels.push_back(relabel);
    return batch;
  }
  static UpdateBatch with(InstanceMoveColumns move) {
    UpdateBatch batch;
    batch.instance_moves.push_back(move);
    return batch;
  }
  InstanceMoveColumns instances_to(std::vector<Id> ids, std::vector<double> positions) {
    InstanceMoveColumns move;
    move.ids = columns_.ids(std::move(ids));
    move.positions_f64 = columns_.doubles(std::move(positions));
    return move;
  }
  UpdateBatch removing(std::vector<Id> ids) {
    UpdateBatch batch;
    batch.remove_ids = columns_.ids(std::move(ids));
    return batch;
  }
  static UpdateBatch numbered(UpdateBatch batch, uint64_t writer, uint64_t number) {
    batch.writer = writer;
    batch.batch = number;
    return batch;
  }

  UpdateAck apply(const UpdateBatch& batch) {
    const absl::StatusOr<UpdateAck> ack = scene_.apply(batch);
    EXPECT_TRUE(ack.ok()) << ack.status();
    return ack.ok() ? *ack : UpdateAck{};
  }

  PlacementColumns placement(std::vector<Id> ids, std::vector<double> translations) {
    PlacementColumns place;
    place.mesh = mesh_;
    place.ids = columns_.ids(std::move(ids));
    place.translations = columns_.doubles(std::move(translations));
    return place;
  }
  static StaticChange placing(PlacementColumns place) {
    StaticChange change;
    change.place.push_back(std::move(place));
    return change;
  }

  uint64_t revision() const { return scene_.latest()->revision; }
  std::optional<Object> object(Id id) const { return scene_.latest()->objects.find(id); }
  std::vector<Id> ids() const {
    std::vector<Id> found;
    scene_.latest()->objects.for_each([&](const Object& object) { found.push_back(object.id); });
    std::sort(found.begin(), found.end());
    return found;
  }

  Columns columns_;
  std::shared_ptr<const StaticMesh> mesh_ = make_mesh("m", 1);
  Scene scene_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_FIXTURE_H_
