// Tests StateWriter and StateReader together: complete, incomplete and damaged chunks.
#include "core/scene/log/state_reader.h"

#include <gmock/gmock.h>

#include "core/scene/log/state_writer.h"
#include "core/scene/scene.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/random_updates.h"
#include "tests/support/scene_difference.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

using Chunks = std::vector<std::string>;

class StateReaderTest : public SceneFixture {
 protected:
  Chunks write(StateWriter writer) {
    Chunks chunks;
    while (std::optional<std::string> chunk = *writer.next()) {
      EXPECT_LE(chunk->size(), UpdateLog::kMaxChunkBytes);
      chunks.push_back(*std::move(chunk));
    }
    return chunks;
  }
  Chunks written() { return write(StateWriter(scene_.freeze())); }

  absl::StatusOr<std::unique_ptr<Scene>> read(const Chunks& chunks) {
    StateReader reader;
    for (const std::string& chunk : chunks)
      if (absl::Status status = reader.add(chunk); !status.ok()) return status;
    absl::StatusOr<SceneState> state = std::move(reader).finish([this](const MeshKey&) { return mesh_; });
    if (!state.ok()) return state.status();
    absl::StatusOr<SceneWriter> writer = SceneWriter::restore(*std::move(state), {}, {});
    if (!writer.ok()) return writer.status();
    return std::make_unique<Scene>("scene", SceneSpec(), *std::move(writer), SceneLog());
  }

  void live(uint64_t seed, int batches) {
    Random random(seed);
    RandomUpdates updates(random, 50);
    for (int i = 0; i < batches; ++i) scene_.apply(updates.draw(columns_, 8)).IgnoreError();
    ASSERT_TRUE(scene_.change_instances(placing(placement({}, {1, 2, 3, 4, 5, 6}))).ok());
  }

  void insert_balls(size_t count) {
    std::vector<Id> ids(count);
    std::vector<float> positions(3 * count), radii(count);
    Random random(7);
    for (size_t i = 0; i < count; ++i) {
      ids[i] = i + 1000;
      radii[i] = static_cast<float>(random.magnitude(-6, 6));
      for (size_t axis = 0; axis < 3; ++axis) positions[3 * i + axis] = random.float_between(-500, 500);
    }
    InsertColumns insert = balls(ids, radii);
    insert.positions = columns_.floats(positions);
    apply(with(insert));
  }

  Random random_{3};
};

TEST_F(StateReaderTest, AnEmptySceneIsOneChunk) {
  const Chunks chunks = written();
  EXPECT_EQ(chunks.size(), 1u);
  const auto again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(scene_difference(**again, scene_, random_), "");
}

TEST_F(StateReaderTest, RestoredRandomScenesEqualTheOriginalsAndContinueAlike) {
  for (uint64_t seed = 0; seed < scaled_count(40); ++seed) {
    live(seed, 60);
    const auto again = read(written());
    ASSERT_TRUE(again.ok()) << again.status();
    ASSERT_EQ(scene_difference(**again, scene_, random_), "") << seed;
    RandomUpdates updates(random_, 50);
    for (int i = 0; i < 40; ++i) {
      const UpdateBatch batch = updates.draw(columns_, 8);
      ASSERT_EQ(ack_difference((*again)->apply(batch), scene_.apply(batch)), "") << seed;
    }
    ASSERT_EQ(scene_difference(**again, scene_, random_), "") << seed;
  }
}

TEST_F(StateReaderTest, ManyObjectsAndInstancesTakeManyChunks) {
  insert_balls(30'000);
  std::vector<double> translations(3 * 9000);
  for (double& number : translations) number = random_.between(-1000, 1000);
  PlacementColumns place = placement({}, translations);
  std::vector<float> rotations;
  for (size_t i = 0; i < 9000; ++i) {
    const Quaternion q = random_.rotation();
    rotations.insert(rotations.end(), {q.x, q.y, q.z, q.w});
  }
  place.rotations = columns_.floats(rotations);
  ASSERT_TRUE(scene_.change_instances(placing(place)).ok());
  const Chunks chunks = written();
  EXPECT_EQ(chunks.size(), 1u + 4 + 3);
  const auto again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(scene_difference(**again, scene_, random_), "");
}

TEST_F(StateReaderTest, ManyWritersWithManyErrorsTakeManyChunks) {
  for (uint64_t writer = 1; writer <= 60; ++writer) {
    UpdateBatch batch = numbered(removing(std::vector<Id>(1000, 9)), writer, 1);
    apply(batch);
  }
  const Chunks chunks = written();
  EXPECT_LT(2u, chunks.size());
  const auto again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(scene_difference(**again, scene_, random_), "");
}

TEST_F(StateReaderTest, EveryReasonOfARefusedItemComesBackAndNoLaterOne) {
  for (uint32_t number = 0; number <= static_cast<uint32_t>(kLastReason) + 1; ++number) {
    WriterTable::Writer writer;
    writer.number = 7;
    writer.batch = 1;
    writer.heard = 1;
    writer.ack.epoch = kEpoch;
    writer.ack.errors = {{"moves[0].ids", 3, 9, static_cast<Reason>(number)}};
    FrozenScene frozen = scene_.freeze();
    ASSERT_TRUE(frozen.writers.restore(writer));
    const Chunks chunks = write(StateWriter(frozen));
    StateReader reader;
    absl::Status status;
    for (const std::string& chunk : chunks) status.Update(reader.add(chunk));
    if (number > static_cast<uint32_t>(kLastReason)) {
      EXPECT_EQ(status, absl::DataLossError("the reason of an error is unknown"));
      continue;
    }
    ASSERT_TRUE(status.ok()) << number << ": " << status;
    const absl::StatusOr<SceneState> state = std::move(reader).finish([](const MeshKey&) { return nullptr; });
    ASSERT_TRUE(state.ok()) << state.status();
    EXPECT_EQ(state->writers.writers().at(0).ack.errors.at(0).reason, static_cast<Reason>(number));
  }
}

TEST_F(StateReaderTest, TheSceneMayChangeWhileItsStateIsWritten) {
  insert_balls(20'000);
  const auto before = read(written());
  ASSERT_TRUE(before.ok());
  StateWriter writer(scene_.freeze());
  Chunks chunks;
  for (Id id = 1000; std::optional<std::string> chunk = *writer.next(); id += 100) {
    chunks.push_back(*std::move(chunk));
    apply(with(move_to({id, id + 1}, {1, 2, 3})));
    apply(removing({id + 2}));
  }
  const auto again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(scene_difference(**again, **before, random_), "");
}

TEST_F(StateReaderTest, AMissingOrRepeatedChunkIsDetected) {
  live(1, 60);
  const Chunks chunks = written();
  ASSERT_EQ(chunks.size(), 7u);  // header, writers, instances, compounds, objects, expiries, leases
  for (size_t i = 0; i < chunks.size(); ++i) {
    Chunks fewer = chunks, more = chunks;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(i), chunks[i]);
    EXPECT_EQ(read(fewer).status().code(), absl::StatusCode::kDataLoss) << i;
    EXPECT_EQ(read(more).status().code(), absl::StatusCode::kDataLoss) << i;
  }
}

TEST_F(StateReaderTest, ManyExpiriesAndLeasesTakeManyChunks) {
  std::vector<Id> ids(100'000);
  for (size_t i = 0; i < ids.size(); ++i) ids[i] = i + 1;
  std::vector<uint64_t> expire_ticks(ids.size());
  for (uint64_t& ticks : expire_ticks) ticks = random_.below(3) * 100;
  UpdateBatch batch = numbered(with(points(ids, {1, 2, 3})), 7, 1);
  batch.inserts[0].expire_ticks = columns_.ids(expire_ticks);
  batch.lease_ms = 20;
  apply(batch);
  for (uint64_t writer = 10; writer < 200; ++writer) {
    UpdateBatch lease = numbered(with(points({1'000'000 + writer}, {1, 2, 3})), writer, 1);
    if (writer % 2 == 0) lease.inserts.clear();
    lease.lease_ms = static_cast<uint32_t>(writer);
    apply(lease);
  }
  const Chunks chunks = written();
  EXPECT_EQ(chunks.size(), 1u + 1 + 13 + 3 + 4);
  const auto again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(scene_difference(**again, scene_, random_), "");
}

TEST_F(StateReaderTest, AnExpiryOrALeaseOfNoObjectIsDamage) {
  UpdateBatch batch = numbered(with(points({1, 2}, {0, 0, 0})), 7, 1);
  batch.inserts[0].expire_ticks = columns_.ids({5});
  batch.lease_ms = 20;
  apply(batch);
  for (const char* const kind : {"LSTE", "LSTL"}) {
    Chunks wrong = written();
    const auto chunk =
        std::find_if(wrong.begin(), wrong.end(), [kind](const std::string& one) { return one.substr(0, 4) == kind; });
    ASSERT_NE(chunk, wrong.end());
    (*chunk)[chunk->rfind('\2')] = 9;  // the id 2 becomes 9
    EXPECT_THAT(read(wrong).status().message(), HasSubstr("9")) << kind;
  }
}

TEST_F(StateReaderTest, AMissingMeshIsDetected) {
  live(1, 5);
  mesh_ = nullptr;
  EXPECT_THAT(read(written()).status().message(), HasSubstr("a mesh that instances use is missing"));
}

TEST_F(StateReaderTest, DamagedBytesNeverHarm) {
  live(2, 60);
  const Chunks chunks = written();
  uint64_t refused = 0, taken = 0;
  for (uint64_t i = 0; i < scaled_count(20000); ++i) {
    Chunks wrong = chunks;
    std::string& chunk = wrong[random_.below(wrong.size())];
    chunk = damaged(chunk, random_);
    const auto again = read(wrong);
    ++(again.ok() ? taken : refused);
    if (again.ok())
      (*again)->apply(with(move_to({1, 2, 3}, {0, 0, 0}))).IgnoreError();
    else
      EXPECT_EQ(again.status().code(), absl::StatusCode::kDataLoss) << again.status();
  }
  EXPECT_NE(refused, 0u);
  EXPECT_NE(taken, 0u);
}

}  // namespace
}  // namespace locus::test
