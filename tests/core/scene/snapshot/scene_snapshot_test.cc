// Tests readers that run concurrently with a fast writer and with static changes: the readers never wait, and every
// read sees one complete revision.
#include "core/scene/snapshot/scene_snapshot.h"

#include <atomic>
#include <optional>
#include <thread>

#include "tests/support/run_batch.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Number of objects. In all revisions of tick t, object i is at x = t + i / 1024, has a y coordinate of its own, and
// has the tag t.
constexpr uint64_t kObjects = 200;

double place_of(uint64_t i, uint64_t tick) { return static_cast<double>(tick) + static_cast<double>(i) / 1024; }

struct WorldVisitor {
  Aabbd bounds() const { return {{-4e9, -4e9, -4e9}, {4e9, 4e9, 4e9}}; }
  bool overlaps(const Aabbd&) const { return true; }
  bool visit(const Object& object) {
    found.push_back(object);
    return true;
  }
  std::vector<Object> found;
};

void expect_object_of(const Object& object, uint64_t tick) {
  EXPECT_EQ(object.tag, tick);
  EXPECT_EQ(object.shape.position.x, place_of(object.id, tick)) << "object " << object.id;
}

// Reads the objects by a visit of a region and by their ids, and expects that both give the objects of one revision.
void expect_whole(const SceneSnapshot& snapshot) {
  WorldVisitor visitor;
  Work work;
  snapshot.objects.visit_region(visitor, work);
  ASSERT_EQ(visitor.found.size(), kObjects);
  for (const Object& object : visitor.found) expect_object_of(object, snapshot.tick);
  for (uint64_t id = 1; id <= kObjects; ++id) {
    const std::optional<Object> object = snapshot.objects.find(id);
    ASSERT_TRUE(object.has_value()) << id;
    expect_object_of(*object, snapshot.tick);
  }
}

// Runs a batch of three blocks and expects that all answers are about one revision. The blocks contain a lookup of all
// objects, a ball around all objects, and a ray along the line of each object.
void expect_answers_of_one_revision(const SceneSnapshot& snapshot) {
  std::vector<uint64_t> ids;
  std::vector<float> origins;
  for (uint64_t id = 1; id <= kObjects; ++id) {
    ids.push_back(id);
    for (const float x : {-10.0f, 4.0f * static_cast<float>(id), 0.0f}) origins.push_back(x);
  }
  const float along[] = {1, 0, 0}, center[] = {0, 0, 0}, radius[] = {1e6f};
  QueryBatch batch;
  batch.blocks.resize(3);
  batch.blocks[0].columns = {Column::kTag, Column::kPose};
  batch.blocks[0].kind = LookupColumns{ids, {}};
  batch.blocks[1].columns = {Column::kId, Column::kTag};
  batch.blocks[1].source = Source::kDynamic;
  batch.blocks[1].kind = BallColumns{center, radius, StaticDetail::kInstances};
  batch.blocks[2].columns = {Column::kId, Column::kTag};
  RayColumns rays;
  rays.origins = origins;
  rays.directions = along;
  batch.blocks[2].kind = rays;
  ASSERT_TRUE(check_batch(batch).ok()) << check_batch(batch);
  const absl::StatusOr<BatchResult> result = run_batch(snapshot, batch, {});
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->blocks[0].positions.size(), 3 * kObjects);
  for (uint64_t id = 1; id <= kObjects; ++id)
    EXPECT_EQ(result->blocks[0].positions[3 * (id - 1)], place_of(id, snapshot.tick));
  for (const BlockResult& block : result->blocks) {
    EXPECT_EQ(block.tags.size(), kObjects);
    for (const uint64_t tag : block.tags) EXPECT_EQ(tag, snapshot.tick);
  }
  EXPECT_EQ(result->blocks[1].ids, ids);
  EXPECT_EQ(result->blocks[2].ids, ids);
}

class SceneSnapshotTest : public SceneFixture {
 protected:
  SceneSnapshotTest() {
    for (uint64_t id = 1; id <= kObjects; ++id) ids_.push_back(id);
    InsertColumns insert;
    insert.ids = ids_;
    insert.kind = ShapeKind::kBall;
    const float radius[] = {0.5f};
    insert.radii = radius;
    insert.positions_f64 = positions_at(0);
    apply(with(insert));
  }

  absl::Span<const double> positions_at(uint64_t tick) {
    positions_.clear();
    for (const Id id : ids_)
      positions_.insert(positions_.end(), {place_of(id, tick), 4.0 * static_cast<double>(id), 0.0});
    return positions_;
  }

  // Moves all objects to their positions at `tick`, in one of several equivalent ways.
  void write(uint64_t tick) {
    UpdateBatch batch;
    batch.tick = tick;
    const uint64_t tags[] = {tick};
    const float radius[] = {0.5f};
    if (tick % 5 == 0) {
      InsertColumns insert;
      insert.ids = ids_;
      insert.kind = ShapeKind::kBall;
      insert.radii = radius;
      insert.positions_f64 = positions_at(tick);
      insert.tags = tags;
      batch.inserts.push_back(insert);
      batch.clear = tick % 2 == 0;
      batch.upsert = !batch.clear;
    } else {
      batch.moves.emplace_back();
      batch.moves[0].ids = ids_;
      batch.moves[0].positions_f64 = positions_at(tick);
      batch.relabels.emplace_back();
      batch.relabels[0].ids = ids_;
      batch.relabels[0].tags = tags;
    }
    EXPECT_EQ(apply(batch).refused, 0u);
  }

  // Places an instance far above the lines along which objects move. If `id` is a multiple of 8, also removes all other
  // instances.
  void place(Id id) {
    const double translation[] = {0, 0, 1000};
    StaticChange change = placing({mesh_, {&id, 1}, translation, {}, {}, {}, {}, {}});
    if (id % 8 != 0) {
      EXPECT_TRUE(scene_.change_instances(change).ok());
      return;
    }
    std::vector<Id> placed;
    for (const Instance& instance : scene_.latest()->statics->tree().values()) placed.push_back(instance.id);
    change.remove_ids = placed;
    EXPECT_TRUE(scene_.change_instances(change).ok());
  }

  std::vector<Id> ids_;
  std::vector<double> positions_;
};

TEST_F(SceneSnapshotTest, ReadersSeeCompleteRevisionsWhileTheWriterContinues) {
  std::atomic<bool> done{false};
  std::atomic<uint64_t> reads{0};
  const auto read = [&](bool batches) {
    uint64_t last = 0;
    while (!done) {
      const SnapshotPtr snapshot = scene_.latest();
      EXPECT_GE(snapshot->revision, last);
      last = snapshot->revision;
      if (batches) {
        expect_answers_of_one_revision(*snapshot);
      } else {
        expect_whole(*snapshot);
      }
      ++reads;
    }
  };
  std::thread first(read, false), second(read, true), third(read, true);
  std::thread builder([&] {
    for (Id id = 1001; !done; ++id) place(id);
  });
  const uint64_t least = scaled_count(500);
  uint64_t tick = 0;
  while (tick < least || reads < least) write(++tick);
  done = true;
  for (std::thread* thread : {&first, &second, &third, &builder}) thread->join();
  EXPECT_EQ(scene_.latest()->tick, tick);
}

TEST_F(SceneSnapshotTest, OldSnapshotsDoNotChangeWhileTheWriterContinues) {
  std::vector<SnapshotPtr> kept;
  std::vector<uint64_t> ticks;
  for (uint64_t tick = 1; tick <= 30; ++tick) {
    write(tick);
    if (tick % 5 == 0) place(1000 + tick);
    kept.push_back(scene_.latest());
    ticks.push_back(tick);
  }
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (uint64_t tick = 31; !done; ++tick) write(tick);
  });
  for (size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i]->tick, ticks[i]);
    EXPECT_EQ(kept[i]->statics->size(), ticks[i] / 5 % 8);
    expect_whole(*kept[i]);
    expect_answers_of_one_revision(*kept[i]);
  }
  done = true;
  writer.join();
}

TEST_F(SceneSnapshotTest, AnyThreadMayDropSnapshotsWhileTheWriterContinues) {
  std::atomic<bool> done{false};
  const auto read = [&] {
    std::vector<SnapshotPtr> kept(16);
    for (size_t i = 0; !done; ++i) {
      SnapshotPtr& oldest = kept[i % kept.size()];
      if (oldest != nullptr) expect_whole(*oldest);
      oldest = scene_.latest();
    }
  };
  std::thread first(read), second(read);
  for (uint64_t tick = 1; tick <= scaled_count(500); ++tick) write(tick);
  done = true;
  first.join();
  second.join();
}

TEST_F(SceneSnapshotTest, WritersOfDisjointObjectsBothSucceed) {
  const uint64_t count = scaled_count(500);
  const auto run = [&](Id id) {
    for (uint64_t i = 1; i <= count; ++i) {
      const double position[] = {static_cast<double>(i), 0, 0};
      UpdateBatch batch = numbered({}, id, i);
      batch.moves.emplace_back();
      batch.moves[0].ids = {&id, 1};
      batch.moves[0].positions_f64 = position;
      const auto ack = scene_.apply(batch);
      ASSERT_TRUE(ack.ok());
      const auto snapshot = scene_.view({View::Kind::kAtLeast, ack->revision, ack->epoch}, {});
      ASSERT_TRUE(snapshot.ok());
      EXPECT_EQ((*snapshot)->objects.find(id)->shape.position.x, static_cast<double>(i));
    }
  };
  std::thread first(run, 1), second(run, 2);
  first.join();
  second.join();
  EXPECT_EQ(revision(), 1 + 2 * count);
}

}  // namespace
}  // namespace locus::test
