// Tests check_form(): which column lengths, frames and values it refuses, and which field the refusal names.
#include "core/scene/updates/update_batch.h"

#include <limits>

#include "core/base/limits.h"
#include "gtest/gtest.h"
#include "tests/support/columns.h"

namespace locus::test {
namespace {

class UpdateFormTest : public ::testing::Test {
 protected:
  UpdateFormTest() {
    batch_.inserts.emplace_back();
    insert().ids = columns_.ids({1, 2, 3});
    insert().positions = columns_.floats(std::vector<float>(9));
    batch_.moves.emplace_back();
    batch_.moves[0].ids = columns_.ids({1, 2, 3});
    batch_.moves[0].positions = columns_.floats(std::vector<float>(9));
    batch_.relabels.emplace_back();
    batch_.relabels[0].ids = columns_.ids({1, 2, 3});
  }

  InsertColumns& insert() { return batch_.inserts[0]; }

  // Returns the field that check_form() names in its refusal of the batch; an empty string if it accepts the batch.
  std::string refused_field(Reason reason = Reason::kColumnLength) {
    const absl::Status status = check_form(batch_);
    if (status.ok()) return "";
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    const std::optional<Refusal> refusal = refusal_of(status);
    EXPECT_EQ(refusal->reason, reason) << status;
    return refusal->field;
  }

  // Tries each length of `column` from 0 to 3 * width + 1 values. Returns the accepted lengths, in entries of `width`
  // values, and expects that all other lengths are refused with the field `field`.
  template <class T>
  std::vector<size_t> accepted(absl::Span<const T>& column, size_t width, const std::string& field) {
    const absl::Span<const T> before = column;
    std::vector<size_t> lengths;
    for (size_t length = 0; length <= 3 * width + 1; ++length) {
      column = columns_.keep(std::vector<T>(length));
      const std::string refused = refused_field();
      if (refused.empty()) {
        EXPECT_EQ(length % width, 0u);
        lengths.push_back(length / width);
      } else {
        EXPECT_EQ(refused, field);
      }
    }
    column = before;
    return lengths;
  }

  Columns columns_;
  UpdateBatch batch_;
};

using Lengths = std::vector<size_t>;

TEST_F(UpdateFormTest, AnEmptyBatchIsFine) {
  batch_ = {};
  EXPECT_EQ(refused_field(), "");
}

TEST_F(UpdateFormTest, AnEmptyListIsFine) {
  batch_ = {};
  batch_.inserts.resize(1);
  batch_.moves.resize(1);
  batch_.relabels.resize(1);
  EXPECT_EQ(refused_field(), "");
}

TEST_F(UpdateFormTest, PositionsHaveOneEntryEachOrOneForAll) {
  EXPECT_EQ(accepted(insert().positions, 3, "inserts[0].positions"), (Lengths{1, 3}));
}

TEST_F(UpdateFormTest, AbsolutePositionsHaveOneEntryEachOrOneForAll) {
  batch_.moves[0].positions = {};
  batch_.moves[0].positions_f64 = columns_.doubles({1, 2});
  EXPECT_EQ(refused_field(), "moves[0].positions_f64");
  batch_.moves[0].positions_f64 = columns_.doubles({1, 2, 3});
  EXPECT_EQ(refused_field(), "");
}

TEST_F(UpdateFormTest, MovedPositionsHaveOneEntryEachOrOneForAll) {
  EXPECT_EQ(accepted(batch_.moves[0].positions, 3, "moves[0].positions"), (Lengths{1, 3}));
}

TEST_F(UpdateFormTest, BothKindsOfPositionsAreRefused) {
  insert().positions_f64 = columns_.doubles(std::vector<double>(9));
  EXPECT_EQ(refused_field(Reason::kMalformed), "inserts[0].positions_f64");
}

TEST_F(UpdateFormTest, RotationsMayBeAbsent) {
  EXPECT_EQ(accepted(insert().rotations, 4, "inserts[0].rotations"), (Lengths{0, 1, 3}));
  EXPECT_EQ(accepted(batch_.moves[0].rotations, 4, "moves[0].rotations"), (Lengths{0, 1, 3}));
}

TEST_F(UpdateFormTest, LabelsMayBeAbsent) {
  EXPECT_EQ(accepted(insert().layers, 1, "inserts[0].layers"), (Lengths{0, 1, 3}));
  EXPECT_EQ(accepted(insert().groups, 1, "inserts[0].groups"), (Lengths{0, 1, 3}));
  EXPECT_EQ(accepted(insert().tags, 1, "inserts[0].tags"), (Lengths{0, 1, 3}));
}

TEST_F(UpdateFormTest, NewLabelsMayBeAbsent) {
  EXPECT_EQ(accepted(batch_.relabels[0].layers, 1, "relabels[0].layers"), (Lengths{0, 1, 3}));
  EXPECT_EQ(accepted(batch_.relabels[0].groups, 1, "relabels[0].groups"), (Lengths{0, 1, 3}));
  EXPECT_EQ(accepted(batch_.relabels[0].tags, 1, "relabels[0].tags"), (Lengths{0, 1, 3}));
}

TEST_F(UpdateFormTest, BallsNeedRadii) {
  insert().kind = ShapeKind::kBall;
  EXPECT_EQ(accepted(insert().radii, 1, "inserts[0].ball.radii"), (Lengths{1, 3}));
}

TEST_F(UpdateFormTest, BoxesNeedHalfExtents) {
  insert().kind = ShapeKind::kBox;
  EXPECT_EQ(accepted(insert().extents, 3, "inserts[0].box.half_extents"), (Lengths{1, 3}));
}

TEST_F(UpdateFormTest, CapsulesNeedRadiiAndHalfAxes) {
  insert().kind = ShapeKind::kCapsule;
  insert().extents = columns_.floats({0, 0, 1});
  EXPECT_EQ(accepted(insert().radii, 1, "inserts[0].capsule.radii"), (Lengths{1, 3}));
  insert().radii = columns_.floats({1});
  EXPECT_EQ(accepted(insert().extents, 3, "inserts[0].capsule.half_axes"), (Lengths{1, 3}));
}

TEST_F(UpdateFormTest, TheSecondListIsNamedAsSuch) {
  batch_.moves.push_back(batch_.moves[0]);
  batch_.moves[1].positions = {};
  EXPECT_EQ(refused_field(), "moves[1].positions");
}

TEST_F(UpdateFormTest, AFrameMustBeFinite) {
  batch_.frame.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused_field(Reason::kNotFinite), "frame");
  batch_.frame.y = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refused_field(Reason::kNotFinite), "frame");
}

TEST_F(UpdateFormTest, AFrameMustLieWithinTheWorld) {
  batch_.frame.z = -1e9;
  EXPECT_EQ(refused_field(), "");
  batch_.frame.z = std::nextafter(-1e9, -2e9);
  EXPECT_EQ(refused_field(Reason::kOutOfRange), "frame");
}

TEST_F(UpdateFormTest, AWriterNeedsABatchNumber) {
  batch_.writer = 7;
  EXPECT_EQ(refused_field(Reason::kMalformed), "batch");
}

TEST_F(UpdateFormTest, ABatchNumberNeedsAWriter) {
  batch_.batch = 1;
  EXPECT_EQ(refused_field(Reason::kMalformed), "writer");
}

TEST_F(UpdateFormTest, TooManyItemsNameTheLimit) {
  batch_ = {};
  batch_.remove_ids = columns_.ids(std::vector<uint64_t>(limits::kMaxUpdateItems - 1));
  batch_.remove_groups = columns_.ids({1});
  EXPECT_EQ(refused_field(), "");
  batch_.relabels.emplace_back();
  batch_.relabels[0].ids = columns_.ids({1});
  EXPECT_EQ(refused_field(Reason::kLimit), "batch");
  const Refusal refusal = refusal_of(check_form(batch_)).value();
  EXPECT_EQ(refusal.limit, "update_items");
  EXPECT_EQ(refusal.limit_value, limits::kMaxUpdateItems);
  EXPECT_EQ(refusal.asked, limits::kMaxUpdateItems + 1.0);
}

TEST_F(UpdateFormTest, ExpireTicksHaveOneEntryEachOrOneForAll) {
  EXPECT_EQ(accepted(insert().expire_ticks, 1, "inserts[0].expire_ticks"), (std::vector<size_t>{0, 1, 3}));
}

TEST_F(UpdateFormTest, ALeaseBelongsToAWriterAndLastsAtMostADay) {
  batch_.lease_ms = 1;
  EXPECT_EQ(refused_field(Reason::kMalformed), "lease_ms");
  batch_.writer = batch_.batch = 1;
  batch_.lease_ms = limits::kMaxLeaseMs;
  EXPECT_EQ(refused_field(), "");
  batch_.lease_ms = limits::kMaxLeaseMs + 1;
  EXPECT_EQ(refused_field(Reason::kLimit), "lease_ms");
}

TEST_F(UpdateFormTest, OnlyTheLastMessageHasSettings) {
  const auto refused = [this](auto UpdateBatch::*field, auto value) {
    batch_.earlier.assign(2, UpdateBatch());
    batch_.earlier[1].*field = value;
    return refused_field(Reason::kMalformed);
  };
  EXPECT_EQ(refused(&UpdateBatch::tick, 3), "tick");
  EXPECT_EQ(refused(&UpdateBatch::restart_ticks, true), "restart_ticks");
  EXPECT_EQ(refused(&UpdateBatch::writer, 3), "writer");
  EXPECT_EQ(refused(&UpdateBatch::batch, 3), "batch");
  EXPECT_EQ(refused(&UpdateBatch::all_or_nothing, true), "all_or_nothing");
  EXPECT_EQ(refused(&UpdateBatch::lease_ms, 3), "lease_ms");
  EXPECT_EQ(refused(&UpdateBatch::end_lease, 3), "end_lease");
  EXPECT_EQ(refused(&UpdateBatch::upsert, true), "");
  EXPECT_EQ(refused(&UpdateBatch::clear, true), "");
}

TEST_F(UpdateFormTest, EarlierMessagesAreCheckedAndCountTowardsTheLimits) {
  batch_.earlier.emplace_back(batch_).inserts[0].ids = {};
  EXPECT_EQ(refused_field(), "inserts[0].positions");
  batch_.earlier.assign(limits::kMaxUpdateMessages - 1, UpdateBatch());
  EXPECT_EQ(refused_field(), "");
  batch_.earlier.emplace_back();
  EXPECT_EQ(refused_field(Reason::kLimit), "continues");
  batch_.earlier.assign(1, UpdateBatch());
  batch_.earlier[0].remove_ids = columns_.ids(std::vector<uint64_t>(limits::kMaxUpdateItems - 9));
  EXPECT_EQ(refused_field(), "");
  batch_.earlier[0].remove_groups = columns_.ids({1});
  EXPECT_EQ(refused_field(Reason::kLimit), "batch");
  batch_.earlier[0] = UpdateBatch();
  batch_.earlier[0].moves.resize(limits::kMaxUpdateLists - 3);
  EXPECT_EQ(refused_field(), "");
  batch_.earlier[0].relabels.resize(1);
  EXPECT_EQ(refused_field(Reason::kLimit), "batch");
}

TEST_F(UpdateFormTest, PartsOfCompoundsTakeOneEntryForEachOrForAll) {
  insert().kind = ShapeKind::kCompound;
  EXPECT_EQ(refused_field(Reason::kMalformed), "inserts[0].compound.parts");
  insert().parts.resize(2);
  PartColumns& parts = insert().parts[1];
  for (PartColumns& one : insert().parts) {
    one.positions = columns_.floats(std::vector<float>(9));
    one.radii = columns_.floats({1});
  }
  EXPECT_EQ(refused_field(), "");
  EXPECT_EQ(accepted(parts.radii, 1, "inserts[0].compound.parts[1].ball.radii"), (std::vector<size_t>{1, 3}));
  EXPECT_EQ(accepted(parts.rotations, 4, "inserts[0].compound.parts[1].rotations"), (std::vector<size_t>{0, 1, 3}));
  EXPECT_EQ(accepted(parts.layers, 1, "inserts[0].compound.parts[1].layers"), (std::vector<size_t>{0, 1, 3}));
  parts.kind = ShapeKind::kBox;
  EXPECT_EQ(accepted(parts.extents, 3, "inserts[0].compound.parts[1].box.half_extents"), (std::vector<size_t>{1, 3}));
  parts.extents = columns_.floats({1, 1, 1});
  parts.positions = columns_.floats(std::vector<float>(8));
  EXPECT_EQ(refused_field(), "inserts[0].compound.parts[1].positions");
  parts.positions = {};
  EXPECT_EQ(refused_field(), "inserts[0].compound.parts[1].positions");
}

TEST_F(UpdateFormTest, CompoundsHaveAtMost64Parts) {
  insert().kind = ShapeKind::kCompound;
  insert().parts.resize(2);
  for (PartColumns& one : insert().parts) {
    one.positions = columns_.floats(std::vector<float>(size_t{3} * 32));
    one.radii = columns_.floats({1});
  }
  EXPECT_EQ(refused_field(), "");
  insert().parts[1].positions = columns_.floats(std::vector<float>(size_t{3} * 33));
  EXPECT_EQ(refused_field(Reason::kLimit), "inserts[0].compound.parts");
}

TEST_F(UpdateFormTest, NewPosesOfPartsComeWithTheNumberOfParts) {
  MoveColumns& move = batch_.moves[0];
  move.parts_each = 2;
  EXPECT_EQ(refused_field(Reason::kMalformed), "moves[0].parts_each");
  move.part_rotations = columns_.floats(std::vector<float>(8));
  EXPECT_EQ(refused_field(), "");
  EXPECT_EQ(accepted(move.part_positions, 6, "moves[0].part_positions"), (std::vector<size_t>{0, 1, 3}));
  move.parts_each = 0;
  EXPECT_EQ(refused_field(Reason::kMalformed), "moves[0].parts_each");
  move.parts_each = 65;
  EXPECT_EQ(refused_field(Reason::kLimit), "moves[0].parts_each");
}

TEST_F(UpdateFormTest, PartsCountAsItems) {
  insert().kind = ShapeKind::kCompound;
  PartColumns& parts = insert().parts.emplace_back();
  parts.positions = columns_.floats(std::vector<float>(size_t{3} * 5));
  parts.radii = columns_.floats({1});
  batch_.moves[0].parts_each = 2;
  batch_.moves[0].part_positions = columns_.floats(std::vector<float>(6));
  EXPECT_EQ(count_items(batch_), 3u + 5u + 3u + 6u + 3u);
}

TEST_F(UpdateFormTest, ListsOfPartsCountAsLists) {
  const uint64_t lists = count_lists(batch_);
  insert().kind = ShapeKind::kCompound;
  insert().parts.resize(3);
  batch_.moves[0].parts_each = 2;
  EXPECT_EQ(count_lists(batch_), lists + 4);
  UpdateBatch last;
  last.earlier = {batch_, batch_};
  EXPECT_EQ(count_lists(last), 2 * lists + 8);
}

}  // namespace
}  // namespace locus::test
