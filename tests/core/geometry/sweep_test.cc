#include "core/geometry/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/capsule.h"
#include "core/geometry/triangle_overlap.h"
#include "tests/support/random.h"
#include "tests/support/random_shape.h"
#include "tests/support/triangle_reference.h"

namespace locus {
namespace {

using test::Random;

constexpr MoverKind kMoverKinds[] = {MoverKind::kBall, MoverKind::kCapsule, MoverKind::kBox};

// Returns whether the mover at time t, larger by `by` on every side, shares a point with a primitive, according to the
// predicates of overlap queries.
template <class Primitive>
bool overlaps_at(const Mover& mover, double t, double by, const Primitive& primitive) {
  const Vec3d center = mover.start + mover.way * t;
  if (mover.kind != MoverKind::kBox) {
    if (mover.radius + by < 0) return false;
    return capsule_overlaps(Capsule{center, mover.half_axis, mover.radius + by}, primitive);
  }
  const Vec3d half = mover.half + Vec3d{by, by, by};
  if (std::min({half.x, half.y, half.z}) < 0) return false;
  if constexpr (std::is_same_v<Primitive, Triangle>)
    return box_overlaps(Obbf{to_float(center), to_float(half), mover.rotation}, primitive);
  else
    return box_overlaps(Obbd{center, half, mover.rotation}, primitive);
}

Mover random_mover(Random& random, MoverKind kind, Vec3d target, double size) {
  Mover mover;
  mover.kind = kind;
  const double away = size * random.magnitude(-3, 3);
  mover.start = target + random.vector(away);
  mover.way = (target + random.vector(size) - mover.start) * random.between(0.2, 2);
  if (random.chance(0.1)) mover.way[static_cast<int>(random.below(3))] = 0;
  if (random.chance(0.02)) mover.way = {};
  const double scale = size * random.magnitude(-5, 1);
  if (kind != MoverKind::kBox) mover.radius = scale * random.between(0.01, 1);
  if (kind == MoverKind::kCapsule) mover.half_axis = random.vector(scale * random.between(0, 3));
  if (kind != MoverKind::kBox) return mover;
  for (int axis = 0; axis < 3; ++axis) mover.half[axis] = scale * random.between(0.01, 1);
  if (random.chance(0.7)) mover.rotation = rotation_of(random.rotation());
  return mover;
}

double magnitude_of(const Mover& mover, Vec3d position, double size) {
  return max_component(abs(mover.start)) + max_component(abs(mover.way)) + max_component(abs(position)) + size +
         max_component(extent_of(mover));
}

// Compares a sweep with the overlap predicates at single moments. Returns whether the sweep hits after its start.
template <class Primitive, class Stored>
bool compare_with_overlaps(const Mover& mover, const Primitive& primitive, const Stored& stored, double epsilon,
                           Random& random, const std::string& what) {
  const std::optional<double> t = first_contact(mover, primitive, AtStart::kHit);
  const double end = t.value_or(1);
  for (int sample = 0; sample < 24; ++sample) {
    const double before = end * (sample == 0 ? 0 : sample == 1 ? 1 - 1e-9 : random.between(0, 1));
    if (before == end && t) continue;
    EXPECT_FALSE(overlaps_at(mover, before, -epsilon, stored)) << what << ": an overlap at " << before << " is missed";
  }
  if (!t) return false;
  EXPECT_GE(*t, 0) << what;
  EXPECT_LE(*t, 1) << what;
  EXPECT_TRUE(overlaps_at(mover, *t, epsilon, stored)) << what << ": no contact at " << *t;
  const std::optional<double> passed = first_contact(mover, primitive, AtStart::kPass);
  EXPECT_EQ(passed.has_value(), *t > 0) << what;
  return *t > 0;
}

// Checks that the contact's point belongs to both solids, and that a plane through it separates them.
template <class Primitive, class Stored>
void check_contact(const Mover& mover, const Primitive& primitive, const Stored& stored, double epsilon,
                   const std::string& what) {
  const double t = *first_contact(mover, primitive, AtStart::kHit);
  const Contact contact = contact_at(mover, primitive, t);
  EXPECT_NEAR(squared_length(contact.normal), 1, 1e-12) << what;
  EXPECT_LE(dot(contact.normal, mover.way), epsilon) << what;
  EXPECT_TRUE(capsule_overlaps(Capsule{mover.start + contact.point, {}, epsilon}, stored))
      << what << ": point not on the primitive";
  const Vec3d offset = contact.point - mover.way * t;
  if (mover.kind == MoverKind::kBox) {
    const Vec3d outside = abs(mover.rotation.to_local(offset)) - mover.half;
    EXPECT_LE(max_component(outside), epsilon) << what << ": point not on the mover";
    EXPECT_NEAR(dot(contact.normal, offset), -dot(abs(mover.rotation.to_local(contact.normal)), mover.half), epsilon)
        << what;
  } else {
    EXPECT_NEAR(dot(contact.normal, offset), -mover.radius - std::abs(dot(contact.normal, mover.half_axis)), epsilon)
        << what;
    EXPECT_NEAR(contact.distance, mover.radius, epsilon) << what;
  }
}

TEST(SweepTest, TrianglesAgreeWithOverlapsAtSingleMoments) {
  constexpr uint64_t kSeed = 181;
  Random random(kSeed);
  int hits = 0;
  for (int i = 0; i < 15000; ++i) {
    const Triangle triangle = test::random_triangle(random);
    const MoverKind kind = random.pick(kMoverKinds);
    const double size = test::size_of(triangle);
    const Vec3d target = to_double(triangle.a);
    const Mover mover = random_mover(random, kind, target, size);
    // The overlap of a box is tested in float.
    const double epsilon = magnitude_of(mover, target, size) * (kind == MoverKind::kBox ? 1e-5 : 1e-9);
    const std::string what = "seed " + std::to_string(kSeed) + " case " + std::to_string(i);
    const Corners corners = corners_of(triangle);
    if (compare_with_overlaps(mover, corners, triangle, epsilon, random, what)) {
      ++hits;
      check_contact(mover, corners, triangle, epsilon, what);
      const Contact contact = contact_at(mover, corners, *first_contact(mover, corners, AtStart::kHit));
      for (const Vec3d corner : corners)
        EXPECT_LE(dot(contact.normal, corner - mover.start - contact.point), 10 * epsilon) << what;
    }
    ASSERT_FALSE(HasFailure()) << what;
  }
  EXPECT_GT(hits, 2000);
}

TEST(SweepTest, ShapesAgreeWithOverlapsAtSingleMoments) {
  constexpr uint64_t kSeed = 182;
  Random random(kSeed);
  int hits = 0;
  for (int i = 0; i < 15000; ++i) {
    const Shape shape = test::random_shape(random, random.pick(test::kShapeKinds), random.magnitude(-2, 10));
    const double size = 0.01 + max_component(to_double(shape.size)) + shape.radius;
    const Mover mover = random_mover(random, random.pick(kMoverKinds), shape.position, size);
    const double epsilon = magnitude_of(mover, shape.position, size) * 1e-9;
    const std::string what = "seed " + std::to_string(kSeed) + " case " + std::to_string(i);
    if (compare_with_overlaps(mover, shape, shape, epsilon, random, what)) {
      ++hits;
      check_contact(mover, shape, shape, epsilon, what);
    }
    ASSERT_FALSE(HasFailure()) << what;
  }
  EXPECT_GT(hits, 2000);
}

Mover ball(Vec3d start, Vec3d end, double radius) {
  Mover mover;
  mover.start = start;
  mover.way = end - start;
  mover.radius = radius;
  return mover;
}

constexpr Corners kFloor = {Vec3d{-10, -10, 0}, Vec3d{30, -10, 0}, Vec3d{-10, 30, 0}};

TEST(SweepTest, ABallLandsOnAFaceAnEdgeAndACorner) {
  EXPECT_EQ(first_contact(ball({0, 0, 5}, {0, 0, 0}, 1), kFloor, AtStart::kHit), 0.8);
  EXPECT_EQ(first_contact(ball({0, 0, -5}, {0, 0, 0}, 1), kFloor, AtStart::kHit), 0.8);
  // Beside the edge y = -10, three to the side: the radius of 5 reaches it at a height of 4.
  EXPECT_NEAR(*first_contact(ball({0, -13, 8}, {0, -13, 0}, 5), kFloor, AtStart::kHit), 0.5, 1e-12);
  EXPECT_NEAR(*first_contact(ball({-13, -10, 8}, {-13, -10, 0}, 5), kFloor, AtStart::kHit), 0.5, 1e-12);
  EXPECT_EQ(first_contact(ball({-14, -14, 8}, {-14, -14, 0}, 5), kFloor, AtStart::kHit), std::nullopt);
}

TEST(SweepTest, TouchingCounts) {
  EXPECT_TRUE(first_contact(ball({-50, 0, 1}, {50, 0, 1}, 1), kFloor, AtStart::kHit).has_value());
  EXPECT_FALSE(first_contact(ball({-50, 0, 1.001}, {50, 0, 1.001}, 1), kFloor, AtStart::kHit).has_value());
  EXPECT_EQ(first_contact(ball({0, 0, 3}, {0, 0, 1}, 1), kFloor, AtStart::kHit), 1);
  EXPECT_EQ(first_contact(ball({0, 0, 3}, {0, 0, 1.001}, 1), kFloor, AtStart::kHit), std::nullopt);
}

TEST(SweepTest, ARestingMoverHitsWhatItTouches) {
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {0, 0, 1}, 1), kFloor, AtStart::kHit), 0);
  EXPECT_EQ(first_contact(ball({0, 0, 2}, {0, 0, 2}, 1), kFloor, AtStart::kHit), std::nullopt);
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {0, 0, 1}, 1), kFloor, AtStart::kApproach), std::nullopt);
}

TEST(SweepTest, ApproachIgnoresWhatTheMoverSlidesAlongOrLeaves) {
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {5, 0, 1}, 1), kFloor, AtStart::kHit), 0);
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {5, 0, 1}, 1), kFloor, AtStart::kApproach), std::nullopt);
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {5, 0, 2}, 1), kFloor, AtStart::kApproach), std::nullopt);
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {5, 0, 0.5}, 1), kFloor, AtStart::kApproach), 0);
  EXPECT_EQ(first_contact(ball({0, 0, 1}, {5, 0, 0.5}, 1), kFloor, AtStart::kPass), std::nullopt);
}

TEST(SweepTest, ACapsuleHasCapsAndAnEnd) {
  Mover capsule = ball({0, 0, 9}, {0, 0, 0}, 1);
  capsule.kind = MoverKind::kCapsule;
  capsule.half_axis = {0, 0, 2};
  EXPECT_NEAR(*first_contact(capsule, kFloor, AtStart::kHit), 6.0 / 9, 1e-12);  // its lower cap touches at z = 3
  Shape point;
  point.position = {1, 0, 0};
  EXPECT_NEAR(*first_contact(capsule, point, AtStart::kHit), 7.0 / 9, 1e-6);  // beside the cap: the cylinder's rim
  point.position = {1.001, 0, 0};
  EXPECT_EQ(first_contact(capsule, point, AtStart::kHit), std::nullopt);
}

TEST(SweepTest, ABoxLandsOnItsLowestCorner) {
  Mover box;
  box.kind = MoverKind::kBox;
  box.start = {0, 0, 5};
  box.way = {0, 0, -5};
  box.half = {1, 1, 1};
  EXPECT_NEAR(*first_contact(box, kFloor, AtStart::kHit), 0.8, 1e-12);
  box.rotation = rotation_of({0.38268343f, 0, 0, 0.92387953f});  // 45 degrees around x
  EXPECT_NEAR(*first_contact(box, kFloor, AtStart::kHit), (5 - std::sqrt(2)) / 5, 1e-7);
  const Contact contact = contact_at(box, kFloor, *first_contact(box, kFloor, AtStart::kHit));
  EXPECT_NEAR(contact.normal.z, 1, 1e-7);
  EXPECT_NEAR(contact.point.z, -5, 1e-7);
  EXPECT_NEAR(contact.point.y, 0, 1e-6);
}

TEST(SweepTest, ContactsInsideAnObjectPointToTheShortestWayOut) {
  Shape box;
  box.kind = ShapeKind::kBox;
  box.size = {4, 4, 4};
  const Contact in_box = contact_at(ball({3, 0, 0.5}, {3, 0, 0.5}, 1), box, 0);
  EXPECT_EQ(in_box.distance, -1);
  EXPECT_EQ(in_box.normal, (Vec3d{1, 0, 0}));
  Shape round;
  round.kind = ShapeKind::kBall;
  round.radius = 4;
  const Contact in_ball = contact_at(ball({0, 3, 0}, {0, 3, 0}, 1), round, 0);
  EXPECT_EQ(in_ball.distance, -1);
  EXPECT_EQ(in_ball.normal, (Vec3d{0, 1, 0}));
  Mover capsule = ball({0, 3, 0}, {0, 3, 0}, 1);
  capsule.kind = MoverKind::kCapsule;
  capsule.half_axis = {0, 2, 0};  // sticks out by 1: out by 3 along y, or by 4 along x
  EXPECT_EQ(contact_at(capsule, box, 0).distance, -3);
  EXPECT_EQ(contact_at(capsule, box, 0).normal, (Vec3d{0, 1, 0}));
}

}  // namespace
}  // namespace locus
