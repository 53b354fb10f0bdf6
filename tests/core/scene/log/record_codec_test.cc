// Tests encoding and decoding of records, and decoding of damaged bytes.
#include "core/scene/log/record_codec.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/scene/scene_writer.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/random_updates.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string encoded(const UpdateBatch& batch) {
  std::string bytes;
  encode_batch(batch, bytes);
  return bytes;
}

// Returns true if `a` and `b` have equal bits, so that a NaN equals a NaN with the same bits.
template <class T>
bool same(absl::Span<const T> a, absl::Span<const T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
template <class Columns>
bool same_pose(const Columns& a, const Columns& b) {
  return same(a.ids, b.ids) && same(a.positions, b.positions) && same(a.positions_f64, b.positions_f64) &&
         same(a.rotations, b.rotations);
}
template <class Columns>
bool same_labels(const Columns& a, const Columns& b) {
  return same(a.layers, b.layers) && same(a.groups, b.groups) && same(a.tags, b.tags);
}
template <class Columns>
bool same_size(const Columns& a, const Columns& b) {
  const bool round = a.kind == ShapeKind::kBall || a.kind == ShapeKind::kCapsule;
  const bool long_one = a.kind == ShapeKind::kBox || a.kind == ShapeKind::kCapsule;
  return a.kind == b.kind && same(round ? a.radii : absl::Span<const float>(), b.radii) &&
         same(long_one ? a.extents : absl::Span<const float>(), b.extents);
}
bool same_parts(const PartColumns& a, const PartColumns& b) {
  return same_size(a, b) && same(a.positions, b.positions) && same(a.rotations, b.rotations) &&
         same(a.layers, b.layers);
}
bool same_insert(const InsertColumns& a, const InsertColumns& b) {
  return same_size(a, b) && same_pose(a, b) && same_labels(a, b) && same(a.expire_ticks, b.expire_ticks) &&
         std::equal(a.parts.begin(), a.parts.end(), b.parts.begin(), b.parts.end(), same_parts);
}
bool same_move(const MoveColumns& a, const MoveColumns& b) {
  return a.teleport == b.teleport && same_pose(a, b) && a.parts_each == b.parts_each &&
         same(a.part_positions, b.part_positions) && same(a.part_rotations, b.part_rotations);
}
bool same_relabel(const RelabelColumns& a, const RelabelColumns& b) { return same(a.ids, b.ids) && same_labels(a, b); }

bool same_instance_move(const InstanceMoveColumns& a, const InstanceMoveColumns& b) {
  return a.teleport == b.teleport && same_pose(a, b) && same(a.scales, b.scales);
}

template <class List, class Same>
bool all_same(const List& a, const List& b, const Same& is_same) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), is_same);
}

// Returns whether `b`, the decoded form of `a`, is correct. All columns must be equal, except the columns of an insert
// that the kind of its shape does not use: these must be empty in `b`.
bool same_batch(const UpdateBatch& a, const UpdateBatch& b) {
  return a.frame == b.frame && a.tick == b.tick && a.clear == b.clear && same(a.remove_ids, b.remove_ids) &&
         same(a.remove_groups, b.remove_groups) && all_same(a.inserts, b.inserts, same_insert) &&
         all_same(a.moves, b.moves, same_move) && all_same(a.relabels, b.relabels, same_relabel) &&
         all_same(a.instance_moves, b.instance_moves, same_instance_move) &&
         all_same(a.instance_relabels, b.instance_relabels, same_relabel) && a.upsert == b.upsert &&
         a.all_or_nothing == b.all_or_nothing && a.restart_ticks == b.restart_ticks && a.writer == b.writer &&
         a.batch == b.batch && a.lease_ms == b.lease_ms && a.end_lease == b.end_lease &&
         all_same(a.earlier, b.earlier, same_batch);
}

class RecordCodecTest : public SceneFixture {};

TEST_F(RecordCodecTest, RandomBatchesRoundTrip) {
  Random random(1);
  RandomUpdates updates(random, 40);
  for (uint64_t i = 0; i < scaled_count(2000); ++i) {
    Columns columns;
    const UpdateBatch batch = updates.draw(columns, 20);
    const std::string bytes = encoded(batch);
    EXPECT_EQ(bytes.size() % 8, 0u);
    const absl::StatusOr<Record> record = Record::decode(bytes);
    ASSERT_TRUE(record.ok()) << record.status();
    ASSERT_TRUE(same_batch(batch, std::get<UpdateBatch>(record->content()))) << i;
  }
}

TEST_F(RecordCodecTest, OnlyABatchThatChangesInstancesHasTheNewKind) {
  EXPECT_EQ(encoded(with(move_to({1}, {1, 2, 3}))).substr(0, 4), "LSBH");
  EXPECT_EQ(encoded(with(instances_to({1}, {1, 2, 3}))).substr(0, 4), "LSBI");
  UpdateBatch hide;
  hide.instance_relabels.emplace_back().ids = columns_.ids({1});
  EXPECT_EQ(encoded(hide).substr(0, 4), "LSBI");
}

TEST_F(RecordCodecTest, CompoundsAndNewPosesOfPartsHaveTheKindOfExtendedBatches) {
  EXPECT_EQ(encoded(with(compounds({1}, {0, 0, 1}, {2}))).substr(0, 4), "LSBX");
  MoveColumns move = move_to({1}, {1, 2, 3});
  move.parts_each = 1;
  move.part_positions = columns_.floats({4, 5, 6});
  EXPECT_EQ(encoded(with(move)).substr(0, 4), "LSBX");
}

TEST_F(RecordCodecTest, ExpiryTicksAndLeasesHaveAKindOfTheirOwn) {
  UpdateBatch expiring = with(points({1, 2}, {0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(encoded(expiring).substr(0, 4), "LSBH");
  expiring.inserts[0].expire_ticks = columns_.ids({5, 0});
  expiring.instance_moves.emplace_back().ids = columns_.ids({7});
  expiring.instance_moves[0].positions = columns_.floats({1, 2, 3});
  UpdateBatch leased = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  leased.lease_ms = 1500;
  UpdateBatch ended;
  ended.end_lease = 9;
  for (const UpdateBatch& batch : {expiring, leased, ended}) {
    const std::string bytes = encoded(batch);
    EXPECT_EQ(bytes.substr(0, 4), "LSBX");
    const absl::StatusOr<Record> record = Record::decode(bytes);
    ASSERT_TRUE(record.ok()) << record.status();
    EXPECT_TRUE(same_batch(batch, std::get<UpdateBatch>(record->content())));
  }
}

TEST_F(RecordCodecTest, ABatchOfSeveralMessagesIsOneRecord) {
  UpdateBatch batch = numbered(with(move_to({1}, {2, 2, 2})), 9, 1);
  batch.tick = 4;
  batch.lease_ms = 10;
  batch.earlier = {with(points({1}, {0, 0, 0})), UpdateBatch()};
  batch.earlier[0].inserts[0].expire_ticks = columns_.ids({3});
  batch.earlier[0].frame = {1, 2, 3};
  batch.earlier[1].upsert = true;
  const std::string bytes = encoded(batch);
  EXPECT_EQ(bytes.substr(0, 4), "LSBG");
  const absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok()) << record.status();
  EXPECT_TRUE(same_batch(batch, std::get<UpdateBatch>(record->content())));
}

TEST_F(RecordCodecTest, ASettingOfAnEarlierMessageIsDamage) {
  UpdateBatch batch;
  batch.earlier.emplace_back().tick = 3;
  EXPECT_THAT(std::string(Record::decode(encoded(batch)).status().message()), HasSubstr("only the last message"));
  std::string none = encoded(batch).substr(0, 8) + std::string(8, '\0');
  EXPECT_THAT(std::string(Record::decode(none).status().message()), HasSubstr("the number of messages is 0"));
}

TEST_F(RecordCodecTest, ColumnsAreSpansOfTheBytesThemselves) {
  const std::string bytes = encoded(with(points({1, 2}, {0, 0, 0, 1, 1, 1})));
  const absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok());
  const auto* ids = reinterpret_cast<const char*>(std::get<UpdateBatch>(record->content()).inserts[0].ids.data());
  EXPECT_GE(ids, bytes.data());
  EXPECT_LT(ids, bytes.data() + bytes.size());
}

TEST_F(RecordCodecTest, BytesAtAnyAddressAreReadAndTheRecordMayBeMoved) {
  const UpdateBatch batch = with(points({1, 2}, {0, 0, 0, 1, 1, 1}));
  const std::string bytes = encoded(batch);
  for (size_t shift = 0; shift < 8; ++shift) {
    const std::string shifted = std::string(shift, 'x') + bytes;
    absl::StatusOr<Record> record = Record::decode(absl::string_view(shifted).substr(shift));
    ASSERT_TRUE(record.ok()) << record.status();
    const Record moved = *std::move(record);
    EXPECT_TRUE(same_batch(batch, std::get<UpdateBatch>(moved.content()))) << shift;
  }
}

TEST_F(RecordCodecTest, JoinedBatchesAreDecodedSeparately) {
  const UpdateBatch first = numbered(with(move_to({1}, {1, 0, 0})), 3, 1);
  const UpdateBatch second = numbered(with(move_to({2}, {2, 0, 0})), 3, 2);
  const UpdateBatch* const both[] = {&first, &second};
  std::string bytes;
  encode_joined(both, bytes);
  const absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok()) << record.status();
  const auto& joined = std::get<Record::Joined>(record->content());
  ASSERT_EQ(joined.batches.size(), 2u);
  EXPECT_TRUE(same_batch(first, joined.batches[0]));
  EXPECT_TRUE(same_batch(second, joined.batches[1]));
}

TEST_F(RecordCodecTest, BatchesThatCannotHaveBeenJoinedAreRefused) {
  const UpdateBatch first = with(move_to({1}, {1, 0, 0})), second = with(points({2}, {2, 0, 0}));
  const UpdateBatch* const both[] = {&first, &second};
  std::string bytes;
  encode_joined(both, bytes);
  EXPECT_EQ(Record::decode(bytes).status(), absl::DataLossError("batch 1 cannot have been joined"));
}

TEST_F(RecordCodecTest, AStaticChangeHasTheIdsThatWereChosenAndTheMeshesNamesAndContents) {
  PlacementColumns chosen = placement({}, {1, 2, 3, 4, 5, 6});
  chosen.scales = columns_.floats({2});
  chosen.tags = columns_.ids({7, 8});
  StaticChange change = placing(placement({5}, {9, 9, 9}));
  change.place.push_back(chosen);
  change.remove_ids = columns_.ids({3});
  change.remove_groups = columns_.ids({4, 4});
  std::string bytes;
  encode_change(change, {5, kFirstChosenId | 1, kFirstChosenId | 2}, bytes);
  absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok()) << record.status();
  const auto& read = std::get<Record::Change>(record->content());
  EXPECT_THAT(read.change.remove_ids, ElementsAre(3));
  EXPECT_THAT(read.change.remove_groups, ElementsAre(4, 4));
  EXPECT_THAT(read.meshes, ElementsAre(mesh_->key(), mesh_->key()));
  EXPECT_THAT(read.bounds, ElementsAre(mesh_->bounds(), mesh_->bounds()));
  ASSERT_EQ(read.change.place.size(), 2u);
  EXPECT_THAT(read.change.place[0].ids, ElementsAre(5));
  EXPECT_THAT(read.change.place[1].ids, ElementsAre(kFirstChosenId | 1, kFirstChosenId | 2));
  EXPECT_THAT(read.change.place[1].translations, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(read.change.place[1].scales, ElementsAre(2));
  EXPECT_THAT(read.change.place[1].tags, ElementsAre(7, 8));
  EXPECT_TRUE(read.change.place[1].rotations.empty());
}

// Returns a static change of the given kind that places instance 5. Without `name` and `bounds`, their columns are left
// out, as in older data formats.
std::string old_change(BytesKind kind, const StaticMesh& mesh, const std::optional<std::string>& name,
                       const std::vector<float>& bounds) {
  std::string bytes;
  ByteWriter writer(bytes);
  write_kind(writer, kind);
  for (int column = 0; column < 2; ++column)
    writer.column(absl::Span<const uint64_t>());  // removed ids, removed groups
  writer.number(uint64_t{1});
  writer.column(absl::MakeConstSpan(mesh.sha256()));
  if (name) writer.text(*name);
  if (!bounds.empty()) writer.column(absl::MakeConstSpan(bounds));
  const uint64_t ids[] = {5};
  const double translations[] = {1, 2, 3};
  writer.column(absl::MakeConstSpan(ids));
  writer.column(absl::MakeConstSpan(translations));
  for (int column = 0; column < 5; ++column) writer.column(absl::Span<const uint64_t>());
  return bytes;
}

TEST_F(RecordCodecTest, AStaticChangeOfFormat1NamesContentsOnly) {
  const std::string bytes = old_change(BytesKind::kStaticChange, *mesh_, std::nullopt, {});
  absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok()) << record.status();
  const auto& read = std::get<Record::Change>(record->content());
  EXPECT_THAT(read.meshes, ElementsAre(MeshKey{mesh_->sha256(), ""}));
  EXPECT_THAT(read.change.place.at(0).ids, ElementsAre(5));
}

TEST_F(RecordCodecTest, AStaticChangeOfFormats2And3HasNoBounds) {
  const std::string bytes = old_change(BytesKind::kNamedChange, *mesh_, "m", {});
  absl::StatusOr<Record> record = Record::decode(bytes);
  ASSERT_TRUE(record.ok()) << record.status();
  const auto& read = std::get<Record::Change>(record->content());
  EXPECT_THAT(read.meshes, ElementsAre(mesh_->key()));
  EXPECT_TRUE(read.bounds.empty());
  EXPECT_THAT(read.change.place.at(0).ids, ElementsAre(5));
}

TEST_F(RecordCodecTest, BoundsThatNoMeshHasAreDamage) {
  const auto read = [this](const std::vector<float>& bounds) {
    return Record::decode(old_change(BytesKind::kBoundedChange, *mesh_, "m", bounds)).status();
  };
  EXPECT_TRUE(read({0, 0, 0, 1, 1, 0}).ok());
  EXPECT_EQ(read({0, 0, 0, 1, 1}), absl::DataLossError("the bounds of a mesh have a wrong length"));
  const absl::Status out_of_range = absl::DataLossError("the bounds of a mesh are out of range");
  EXPECT_EQ(read({0, 0, 0, 1, -1, 0}), out_of_range);
  EXPECT_EQ(read({0, 0, 0, 1, NAN, 0}), out_of_range);
  EXPECT_EQ(read({0, 0, 0, 1, 2e9f, 0}), out_of_range);
}

TEST_F(RecordCodecTest, ErrorsNameTheInvalidValue) {
  std::string bytes = encoded(with(points({1}, {0, 0, 0})));
  EXPECT_EQ(Record::decode("").status(), absl::DataLossError("the kind is cut off"));
  EXPECT_EQ(Record::decode(bytes + std::string(8, '\0')).status(), absl::DataLossError("a record has surplus bytes"));
  EXPECT_THAT(Record::decode(absl::string_view(bytes).substr(0, 60)).status().message(), HasSubstr("is cut off"));
  std::string later = bytes;
  later[4] = 9;
  EXPECT_THAT(Record::decode(later).status().message(), HasSubstr("version 9 is not the known version 1"));
  bytes[0] ^= 1;
  EXPECT_EQ(Record::decode(bytes).status(), absl::DataLossError("the kind of a record is not known"));
}

TEST_F(RecordCodecTest, ABatchOfWrongFormIsRefusedNamingTheField) {
  UpdateBatch wrong = with(points({1, 2, 3}, {0, 0, 0, 1, 1, 1}));
  const absl::Status status = Record::decode(encoded(wrong)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("inserts[0].positions"));
}

// Damaged bytes are either refused with DATA_LOSS or decoded to a record that can be applied without a crash. Records
// of joined batches are decoded, but not applied.
TEST_F(RecordCodecTest, DamagedBytesNeverHarm) {
  Random random(2);
  RandomUpdates updates(random, 40);
  SceneWriter writer(1, Winding::kCounterClockwise, StaticSet::empty());
  uint64_t refused = 0, taken = 0;
  for (uint64_t i = 0; i < scaled_count(60000); ++i) {
    Columns columns;
    std::string bytes;
    if (random.chance(0.2)) {
      encode_change(placing(placement({5, 6}, {9, 9, 9, 1, 1, 1})), {5, 6}, bytes);
    } else if (random.chance(0.2)) {
      const UpdateBatch batch = with(move_to({1, 2}, {1, 0, 0, 2, 0, 0}));
      const UpdateBatch* const both[] = {&batch, &batch};
      encode_joined(both, bytes);
    } else {
      encode_batch(updates.draw(columns, 5), bytes);
    }
    const std::string wrong = damaged(bytes, random);
    absl::StatusOr<Record> record = Record::decode(wrong);
    ++(record.ok() ? taken : refused);
    if (!record.ok()) {
      EXPECT_EQ(record.status().code(), absl::StatusCode::kDataLoss) << record.status();
    } else if (const auto* batch = std::get_if<UpdateBatch>(&record->content()); batch != nullptr) {
      writer.apply(*batch).IgnoreError();
    } else if (auto* change = std::get_if<Record::Change>(&record->content()); change != nullptr) {
      for (PlacementColumns& place : change->change.place) place.mesh = mesh_;
      StaticSet::empty()
          ->apply(
              change->change, [](Id) { return false; }, 0)
          .IgnoreError();
    }
  }
  EXPECT_NE(refused, 0u);
  EXPECT_NE(taken, 0u);
}

}  // namespace
}  // namespace locus::test
