// Tests batches that contain only moves, with and without GridMoves::by_handle. A batch moves a few, about half or all
// of the values. Also tests snapshots that share the log of a brick while later moves append to this log.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/base/mutex.h"
#include "core/index/hash_grid/hash_grid.h"
#include "core/index/queries/index_queries.h"
#include "core/scene/objects/object_store.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

std::vector<Object> crowd(size_t count, double half, Random& random, bool with_forms) {
  std::vector<Object> objects(count);
  for (size_t i = 0; i < count; ++i) {
    objects[i].id = i + 1;
    objects[i].tag = 7 * i;
    objects[i].shape = {ShapeKind::kBall, random.vector(half), {}, {}, static_cast<float>(random.between(0.1, 2))};
    if (with_forms && i % 3 == 0) objects[i].shape = {ShapeKind::kBox, random.vector(half), {}, {0.5f, 1, 2}, 0};
  }
  return objects;
}

// Forms of a crowd's objects: only balls, which have the default form; also boxes; also boxes whose moves set
// rotations.
enum class Forms { kBalls, kBoxes, kTurningBoxes };

// ObjectStore and a list of the objects that the store must contain.
class Crowd {
 public:
  Crowd(size_t count, Forms forms, uint64_t seed)
      : random_(seed),
        objects_(crowd(count, kHalf, random_, forms != Forms::kBalls)),
        rotates_(forms == Forms::kTurningBoxes) {
    store_.apply({}, objects_);
  }

  Random& random() { return random_; }
  const std::vector<Object>& objects() const { return objects_; }
  ObjectSet snapshot() { return store_.snapshot(); }

  // Moves a random part of the objects, about `share` of them, each at most once. If `with_indices` is true, also
  // passes GridMoves::by_handle.
  void move(double share, bool with_indices) {
    std::vector<GridMove> moves;
    std::vector<Quaternion> rotations;
    std::vector<uint32_t> by_handle(with_indices ? store_.handle_count() : 0, 12345);
    for (Object& object : objects_) {
      if (!random_.chance(share)) continue;
      Shape& shape = object.shape;
      shape.position = random_.chance(0.1) ? random_.vector(kHalf) : shape.position + random_.vector(1);
      const uint32_t handle = store_.handle(object.id);
      if (with_indices) by_handle[handle] = static_cast<uint32_t>(moves.size());
      moves.push_back({shape.position, handle});
      if (!rotates_ || random_.chance(0.7)) continue;
      shape.rotation = random_.rotation();
      moves.back().rotation = static_cast<uint32_t>(rotations.size());
      rotations.push_back(shape.rotation);
    }
    store_.move({moves, rotations, by_handle});
  }
  // Removes a random object and inserts an object with the same id at another position.
  void replace_one() {
    Object& object = objects_[random_.below(objects_.size())];
    const Object before = object;
    object.shape.position = random_.vector(kHalf);
    store_.apply({&before, 1}, {&object, 1}, {before.id});
  }

 private:
  static constexpr double kHalf = 40;

  Random random_;
  std::vector<Object> objects_;
  bool rotates_;
  ObjectStore store_;
};

void expect_holds(const ObjectSet& set, const std::vector<Object>& objects) {
  ASSERT_EQ(set.size(), objects.size());
  size_t seen = 0;
  set.for_each([&](const Object& object) {
    ++seen;
    EXPECT_EQ(object, objects[object.id - 1]);
  });
  EXPECT_EQ(seen, objects.size());
  for (const Object& object : objects) EXPECT_EQ(set.find(object.id), object);
}

void expect_finds(const ObjectSet& set, const std::vector<Object>& objects, Random& random) {
  for (int i = 0; i < 5; ++i) {
    const Balld ball{random.vector(45), random.between(1, 20)};
    std::vector<Object> found;
    ball_overlap(set, ball, found);
    size_t expected = 0;
    for (const Object& object : objects) expected += ball_overlaps(ball, object.shape) ? 1 : 0;
    EXPECT_EQ(found.size(), expected);
    size_t by_ball = 0;
    Work work;
    set.grid().visit_ball(ball, bounds_of(ball), work, [&](const GridRef& value) {
      by_ball += ball_overlaps(ball, shape_of(value)) ? 1 : 0;
      return true;
    });
    EXPECT_EQ(by_ball, expected);
    for (const Object& object : found) EXPECT_EQ(object, objects[object.id - 1]);
  }
}

class HashGridMovesTest : public ::testing::TestWithParam<Forms> {};

TEST_P(HashGridMovesTest, QueriesEqualTheModelAfterMovesOfAnyShareAndSnapshotsStayUnchanged) {
  Crowd crowd(4'000, GetParam(), 3);
  std::vector<std::pair<ObjectSet, std::vector<Object>>> kept;
  for (uint64_t batch = 0; batch < scaled_count(150); ++batch) {
    Random& random = crowd.random();
    if (random.chance(0.1)) kept.emplace_back(crowd.snapshot(), crowd.objects());
    const double shares[] = {0.0005, 0.002, 0.01, 0.05, 0.3, 0.6, 1};
    crowd.move(shares[random.below(7)], random.chance(0.5));
    if (random.chance(0.2)) crowd.replace_one();
    expect_finds(crowd.snapshot(), crowd.objects(), random);
    if (batch % 10 == 0) expect_holds(crowd.snapshot(), crowd.objects());
  }
  for (const auto& [set, objects] : kept) {
    expect_holds(set, objects);
    expect_finds(set, objects, crowd.random());
  }
}

INSTANTIATE_TEST_SUITE_P(Forms, HashGridMovesTest,
                         ::testing::Values(Forms::kBalls, Forms::kBoxes, Forms::kTurningBoxes), [](const auto& test) {
                           return test.param == Forms::kBalls   ? "BallsOnly"
                                  : test.param == Forms::kBoxes ? "Boxes"
                                                                : "TurningBoxes";
                         });

// A batch of few moves appends to a log that several versions of a brick share: the writer appends while readers read
// earlier versions.
TEST(HashGridMovesThreadsTest, ReadersSeeTheirVersionWhileTheWriterAppendsToTheSharedLog) {
  struct Version {
    ObjectSet set;
    std::vector<Object> objects;
  };
  Crowd crowd(2'000, Forms::kBalls, 4);
  Mutex mutex;
  auto published = std::make_shared<const Version>(Version{crowd.snapshot(), crowd.objects()});
  const auto latest = [&] {
    const MutexLock lock(mutex);
    return published;
  };
  std::atomic<bool> done{false};
  std::atomic<uint64_t> reads{0};
  const auto read = [&](uint64_t seed) {
    for (Random random(seed); !done.load(); ++reads) {
      const std::shared_ptr<const Version> version = latest();
      expect_finds(version->set, version->objects, random);
      const Object& one = random.pick(version->objects);
      EXPECT_EQ(version->set.find(one.id), one);
    }
  };
  std::thread first(read, 1), second(read, 2);
  for (uint64_t batch = 0; batch < scaled_count(400) || reads.load() < scaled_count(200); ++batch) {
    crowd.move(0.003, false);
    auto next = std::make_shared<const Version>(Version{crowd.snapshot(), crowd.objects()});
    const MutexLock lock(mutex);
    published.swap(next);
  }
  done.store(true);
  first.join();
  second.join();
  expect_holds(latest()->set, latest()->objects);
}

}  // namespace
}  // namespace locus::test
