// One writer at full speed and two readers, which wait for the writer only while it exchanges a pointer: each snapshot
// contains exactly one revision.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "core/base/mutex.h"
#include "core/index/hash_grid/hash_grid.h"
#include "core/index/queries/index_queries.h"
#include "core/scene/objects/object_store.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using SharedGrid = std::shared_ptr<const ObjectSet>;

class Published {
 public:
  SharedGrid get() {
    const MutexLock lock(mutex_);
    return grid_;
  }
  void set(SharedGrid grid) {
    const MutexLock lock(mutex_);
    grid_.swap(grid);
  }

 private:
  Mutex mutex_;
  SharedGrid grid_ LOCUS_GUARDED_BY(mutex_);
};

constexpr size_t kObjects = 1'000;

// Expects that a snapshot contains one revision: the tag of an object is the number of the revision that wrote the
// object, and all objects must have the same tag.
void expect_one_revision(const ObjectSet& grid) {
  std::vector<Object> found;
  ball_overlap(grid, {{}, 1e6}, found);
  ASSERT_EQ(found.size(), kObjects);
  std::vector<bool> seen(kObjects);
  for (const Object& object : found) {
    EXPECT_EQ(object.tag, found[0].tag);
    EXPECT_FALSE(seen[object.id - 1]);
    seen[object.id - 1] = true;
  }
  const Object& target = found[found[0].tag % kObjects];
  const Vec3d origin{0, 0, 500};
  std::vector<RayHit<Object>> hits;
  all_rays(grid, ObjectRay({origin, target.shape.position - origin}), 10, kObjects, hits);
  EXPECT_FALSE(hits.empty());
  for (const RayHit<Object>& hit : hits) EXPECT_EQ(hit.value.tag, found[0].tag);
}

TEST(HashGridThreadsTest, EachSnapshotShowsOneRevisionWhileTheWriterContinues) {
  Random random(1);
  std::vector<Object> objects(kObjects);
  for (size_t i = 0; i < kObjects; ++i) {
    objects[i].id = i + 1;
    objects[i].shape = {ShapeKind::kBall, random.vector(100), {}, {}, 0.5f};
  }
  ObjectStore grid;
  grid.apply({}, objects);
  Published published;
  published.set(std::make_shared<const ObjectSet>(grid.snapshot()));

  std::atomic<bool> done{false};
  std::atomic<uint64_t> reads{0};
  const auto read = [&] {
    while (!done.load()) {
      expect_one_revision(*published.get());
      ++reads;
    }
  };
  std::thread first(read), second(read);
  for (uint64_t revision = 1; revision <= scaled_count(300) || reads.load() < scaled_count(300); ++revision) {
    std::vector<Object> moved = objects;
    for (Object& object : moved) {
      object.tag = revision;
      object.shape.position = object.shape.position + random.vector(3);
    }
    grid.apply(objects, moved);
    objects = std::move(moved);
    published.set(std::make_shared<const ObjectSet>(grid.snapshot()));
  }
  done.store(true);
  first.join();
  second.join();
  expect_one_revision(grid.snapshot());
}

}  // namespace
}  // namespace locus::test
