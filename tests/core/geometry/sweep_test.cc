#include "core/geometry/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/sweep_trials.h"

namespace locus {
namespace {

using test::Random;

// Checks that the contact's point belongs to both solids, and that the mover is on one side of the plane through this
// point perpendicular to the contact's normal.
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
    const auto trial = test::triangle_trial(random);
    const std::string what = "seed " + std::to_string(kSeed) + " case " + std::to_string(i);
    ASSERT_EQ(test::sweep_fault(trial, random), "") << what;
    const Corners corners = corners_of(trial.primitive);
    const std::optional<double> t = first_contact(trial.mover, corners, AtStart::kHit);
    if (!t || *t == 0) continue;
    ++hits;
    check_contact(trial.mover, corners, trial.primitive, trial.epsilon, what);
    const Contact contact = contact_at(trial.mover, corners, *t);
    for (const Vec3d corner : corners)
      ASSERT_LE(dot(contact.normal, corner - trial.mover.start - contact.point), 10 * trial.epsilon) << what;
    ASSERT_FALSE(HasFailure()) << what;
  }
  EXPECT_GT(hits, 2000);
}

TEST(SweepTest, ShapesAgreeWithOverlapsAtSingleMoments) {
  constexpr uint64_t kSeed = 182;
  Random random(kSeed);
  int hits = 0;
  for (int i = 0; i < 15000; ++i) {
    const auto trial = test::shape_trial(random);
    const std::string what = "seed " + std::to_string(kSeed) + " case " + std::to_string(i);
    ASSERT_EQ(test::sweep_fault(trial, random), "") << what;
    const std::optional<double> t = first_contact(trial.mover, trial.primitive, AtStart::kHit);
    if (!t || *t == 0) continue;
    ++hits;
    check_contact(trial.mover, trial.primitive, trial.primitive, trial.epsilon, what);
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
  // The next two balls, of radius 5, fall at a horizontal distance of 3 from an edge or a corner of the floor. So they
  // touch the edge or corner when their centre is at a height of 4.
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
  EXPECT_NEAR(*first_contact(capsule, kFloor, AtStart::kHit), 6.0 / 9, 1e-12);  // touches when its centre is at z = 3
  Shape point;
  point.position = {1, 0, 0};
  EXPECT_NEAR(*first_contact(capsule, point, AtStart::kHit), 7.0 / 9, 1e-6);  // touches the rim of the cap
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
  // The capsule's core segment ends 1 outside the box. To leave the box, the segment must move 3 along y or 4 along x.
  capsule.half_axis = {0, 2, 0};
  EXPECT_EQ(contact_at(capsule, box, 0).distance, -3);
  EXPECT_EQ(contact_at(capsule, box, 0).normal, (Vec3d{0, 1, 0}));
}

TEST(SweepTest, NoGrazingContactIsExcludedBeforeTheExactTest) {
  int contacts = 0;
  EXPECT_EQ(test::grazing_difference(20'000, &contacts), "");
  EXPECT_GT(contacts, 5'000);
}

}  // namespace
}  // namespace locus
