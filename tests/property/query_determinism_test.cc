// Results are byte-identical for any order of updates, any history of the scene, any split into batches and blocks, and
// any number of threads.
#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "core/query/columns.h"
#include "tests/support/random_query.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

BatchResult answer(const SceneSnapshot& snapshot, const std::vector<OwnedBlock>& blocks, const RunOptions& options,
                   const ParallelFor& parallel_for = {}) {
  auto result = run_batch(snapshot, batch_of(blocks), options, parallel_for);
  LOCUS_CHECK(result.ok());
  return *std::move(result);
}

// Returns a function that runs the calls in random order, distributed over threads.
ParallelFor scrambled(size_t threads, uint64_t seed) {
  return [threads, seed](size_t count, const std::function<void(size_t)>& run) {
    Random random(seed);
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t{0});
    random.shuffle(order);
    std::vector<std::thread> pool;
    for (size_t t = 0; t < threads; ++t)
      pool.emplace_back([&, t] {
        for (size_t i = t; i < count; i += threads) run(order[i]);
      });
    for (std::thread& thread : pool) thread.join();
  };
}

// Returns the blocks with every query repeated `times` times, so that each block is several chunks long.
std::vector<OwnedBlock> lengthened(const std::vector<OwnedBlock>& blocks, size_t times) {
  std::vector<OwnedBlock> result = blocks;
  for (OwnedBlock& block : result) {
    const size_t n = query_count(block.view());
    const auto repeat = [&](auto& column, size_t width) {
      if (column.size() != n * width || n == 1) return;
      const auto once = column;
      for (size_t i = 1; i < times; ++i) column.insert(column.end(), once.begin(), once.end());
    };
    block.for_each_column(repeat);
  }
  return result;
}

QueryScene scene_of(uint64_t seed) {
  Random random(seed);
  return query_scene(troublesome_sketch(seed, random), random);
}

TEST(QueryDeterminismTest, OrderOfUpdatesAndHistoryChangeNoByte) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    const QueryScene scene = scene_of(seed);
    Random random(seed);
    const SnapshotPtr plain = snapshot_of(scene.world), lived = snapshot_after_history(scene.world, random);
    ASSERT_EQ(difference(answer(*lived, scene.blocks, {}), answer(*plain, scene.blocks, {})), "")
        << scene.world.name << ", seed " << seed;
  }
}

TEST(QueryDeterminismTest, ThreadsChangeNoByte) {
  for (uint64_t seed = 0; seed < scaled_count(60); ++seed) {
    const QueryScene scene = scene_of(seed);
    const std::vector<OwnedBlock> blocks = lengthened(scene.blocks, 40);
    const SnapshotPtr snapshot = snapshot_of(scene.world);
    const BatchResult alone = answer(*snapshot, blocks, {});
    for (const size_t threads : {1, 2, 4})
      ASSERT_EQ(difference(answer(*snapshot, blocks, {}, scrambled(threads, seed)), alone), "")
          << threads << " threads, " << scene.world.name << ", seed " << seed;
  }
}

TEST(QueryDeterminismTest, AFullReplyIsTruncatedAtTheSameRowForAnyNumberOfThreads) {
  for (uint64_t seed = 0; seed < scaled_count(40); ++seed) {
    const QueryScene scene = scene_of(seed);
    const std::vector<OwnedBlock> blocks = lengthened(scene.blocks, 40);
    const SnapshotPtr snapshot = snapshot_of(scene.world);
    QueryBatch batch = batch_of(blocks);
    batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch) + 20'000);
    const auto alone = run_batch(*snapshot, batch, {});
    const auto shared = run_batch(*snapshot, batch, {}, scrambled(4, seed));
    ASSERT_TRUE(alone.ok() && shared.ok());
    ASSERT_EQ(difference(*shared, *alone), "") << scene.world.name << ", seed " << seed;
  }
}

// Appends the result of a part of a block to the result of the whole block.
void append(const BlockResult& part, size_t first_query, BlockResult& whole) {
  const auto add = [](const auto& from, auto& to) { to.insert(to.end(), from.begin(), from.end()); };
  for (const uint32_t query : part.truncated) whole.truncated.push_back(query + static_cast<uint32_t>(first_query));
  for (const uint32_t query : part.unanchored) whole.unanchored.push_back(query + static_cast<uint32_t>(first_query));
  add(part.counts, whole.counts);
  add(part.hits, whole.hits);
  add(part.matrix, whole.matrix);
  add(part.others, whole.others);
  add(part.t, whole.t);
  add(part.ids, whole.ids);
  add(part.triangles, whole.triangles);
  add(part.uvs, whole.uvs);
  add(part.normals, whole.normals);
  add(part.points, whole.points);
  add(part.groups, whole.groups);
  add(part.tags, whole.tags);
  add(part.layers, whole.layers);
  add(part.positions, whole.positions);
  add(part.rotations, whole.rotations);
}

TEST(QueryDeterminismTest, SplitsIntoBatchesAndBlocksChangeNoByte) {
  for (uint64_t seed = 0; seed < scaled_count(300); ++seed) {
    const QueryScene scene = scene_of(seed);
    const SnapshotPtr snapshot = snapshot_of(scene.world);
    const BatchResult whole = answer(*snapshot, scene.blocks, {});
    Random random(seed);
    for (size_t b = 0; b < scene.blocks.size(); ++b) {
      BlockResult joined;
      const size_t n = query_count(scene.blocks[b].view());
      for (size_t begin = 0; begin < n;) {
        const size_t end = std::min(n, begin + 1 + random.below(7));
        append(run_block(*snapshot, scene.blocks[b].part(begin, end)), begin, joined);
        begin = end;
      }
      ASSERT_EQ(difference(joined, whole.blocks[b]), "") << scene.world.name << ", seed " << seed << ", block " << b;
    }
  }
}

// The scene and the frame are moved by whole numbers, so that doubles represent every coordinate exactly.
TEST(QueryDeterminismTest, ADistantFrameGivesTheHitsOfTheSceneAtTheOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
    QueryScene scene = query_scene(walls_on_a_lattice(random), random);
    for (PlacedMesh& placed : scene.world.instances) {
      placed.translation = random.whole_vector(4);
      placed.rotation = {};
      placed.scale = 1;
    }
    for (OwnedBlock& block : scene.blocks) {
      block.settings.frame = {};
      block.settings.precision = Precision::kExact;
      for (float& x : block.points) x = std::round(x * 16) / 16;
      if (std::holds_alternative<CapsuleColumns>(block.settings.kind) ||
          std::holds_alternative<SweepColumns>(block.settings.kind) ||
          std::holds_alternative<SightColumns>(block.settings.kind))
        for (float& x : block.sizes) x = std::round(x * 16) / 16;
    }
    for (Object& object : scene.world.objects) {
      for (int axis = 0; axis < 3; ++axis) object.shape.position[axis] = std::round(object.shape.position[axis]);
      // The positions of parts have no whole coordinates, and are rounded when they are far.
      if (object.compound != nullptr) object.shape.kind = ShapeKind::kBall, object.shape.radius = 1;
      object.compound = nullptr;
    }
    const BatchResult near = answer(*snapshot_of(scene.world), scene.blocks, {});
    for (const double shift : {1e6, -1048576.0, 1e8, -9e8}) {
      QueryScene far = scene;
      const Vec3d by = {shift, -shift / 2, shift / 4};
      for (PlacedMesh& placed : far.world.instances) placed.translation = placed.translation + by;
      for (Object& object : far.world.objects) object.shape.position = object.shape.position + by;
      for (OwnedBlock& block : far.blocks) block.settings.frame = by;
      BatchResult result = answer(*snapshot_of(far.world), far.blocks, {});
      for (size_t b = 0; b < result.blocks.size(); ++b) {
        result.blocks[b].positions = near.blocks[b].positions;
        // The results of nearest queries, pairs and cells are not compared. Their distances may differ, because the
        // distance to a value is at least the distance to its bounds, and bounds are wider at large coordinates.
        const QueryBlock::Kind& kind = far.blocks[b].settings.kind;
        if (std::holds_alternative<NearestColumns>(kind) || std::holds_alternative<PairColumns>(kind) ||
            std::holds_alternative<CellColumns>(kind))
          result.blocks[b] = near.blocks[b];
      }
      ASSERT_EQ(difference(result, near), "") << "shift " << shift << ", seed " << seed;
    }
  }
}

}  // namespace
}  // namespace locus::test
