// PrimitiveTraits supports types of other libraries, and the compiler reports a missing member of a trait by one error
// that names the member.
#include "core/geometry/primitive_traits.h"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/index/list/list_index.h"
#include "core/index/queries/index_queries.h"
#include "gtest/gtest.h"

// Type of another library, in its own namespace.
namespace game {
struct Crate {
  uint32_t serial;
  double x, y, z, size;
};
}  // namespace game

namespace locus {

// A ball as a standard container of four numbers: x, y, z of the centre, then the radius.
using ArrayBall = std::array<double, 4>;

template <>
struct PrimitiveTraits<ArrayBall> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static Shape shape(const ArrayBall& b) {
    return {ShapeKind::kBall, {b[0], b[1], b[2]}, {}, {}, static_cast<float>(b[3])};
  }
  static uint64_t id(const ArrayBall& b) { return static_cast<uint64_t>(b[3]); }  // the radius is the id
  static Aabbd bounds(const ArrayBall& b) { return bounds_of(shape(b)); }
  static Vec3d position(const ArrayBall& b) { return {b[0], b[1], b[2]}; }
  static std::optional<double> ray(const ArrayBall& b, const ObjectRay& ray) {
    const std::optional<ShapeHit> hit = ray_hit(ray, shape(b));
    return hit ? std::optional<double>(hit->t) : std::nullopt;
  }
  static bool ball(const ArrayBall& b, const Balld& ball) { return ball_overlaps(ball, shape(b)); }
  static bool box(const ArrayBall& b, const Obbd& box) { return box_overlaps(box, shape(b)); }
};

template <>
struct PrimitiveTraits<game::Crate> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static Shape shape(const game::Crate& c) {
    const auto half = static_cast<float>(c.size / 2);
    return {ShapeKind::kBox, {c.x, c.y, c.z}, {}, {half, half, half}, 0};
  }
  static uint64_t id(const game::Crate& c) { return c.serial; }
  static Aabbd bounds(const game::Crate& c) { return bounds_of(shape(c)); }
  static Vec3d position(const game::Crate& c) { return {c.x, c.y, c.z}; }
  static std::optional<double> ray(const game::Crate& c, const ObjectRay& ray) {
    const std::optional<ShapeHit> hit = ray_hit(ray, shape(c));
    return hit ? std::optional<double>(hit->t) : std::nullopt;
  }
  static bool ball(const game::Crate& c, const Balld& ball) { return ball_overlaps(ball, shape(c)); }
  static bool box(const game::Crate& c, const Obbd& box) { return box_overlaps(box, shape(c)); }
};

namespace {

static_assert(Primitive<Triangle>);
static_assert(Primitive<ArrayBall>);
static_assert(Primitive<game::Crate>);

ObjectRay ray_along_x() {
  Rayd ray;
  ray.direction = {1, 0, 0};
  return ObjectRay(ray);
}

TEST(PrimitiveTraitsTest, AStandardArrayCanBeStoredAndQueried) {
  ListIndex<ArrayBall> index;
  index.insert({10, 0, 0, 1});
  index.insert({20, 0, 0, 2});
  ArrayBall found{};
  double distance = 100;
  ASSERT_TRUE(first_ray(index, ray_along_x(), found, distance));
  EXPECT_EQ(found[3], 1);
  EXPECT_EQ(distance, 9);
  std::vector<ArrayBall> result;
  ball_overlap(index, {{14, 0, 0}, 3}, result);
  EXPECT_EQ(result, (std::vector<ArrayBall>{{10, 0, 0, 1}}));
}

TEST(PrimitiveTraitsTest, AStructOfAnotherNamespaceCanBeStoredAndQueried) {
  ListIndex<game::Crate> index;
  index.insert({7, 5, 0, 0, 2});
  std::vector<game::Crate> result;
  box_overlap(index, {{8, 2, 0}, {2, 1, 1}, {}}, result);
  ASSERT_EQ(result.size(), 1u);
  EXPECT_EQ(result[0].serial, 7u);
}

TEST(PrimitiveTraitsTest, TheVerticesOfATriangleLieInItsPlane) {
  const Triangle triangle = {{1, 2, 3}, {4, -1, 0}, {2, 2, -5}, 0};
  const std::optional<Plane> plane = PrimitiveTraits<Triangle>::plane(triangle);
  ASSERT_TRUE(plane);
  EXPECT_NEAR(squared_length(plane->normal), 1, 1e-15);
  for (const Vec3d& corner : corners_of(triangle)) EXPECT_NEAR(dot(plane->normal, corner) + plane->offset, 0, 1e-14);
  EXPECT_GT(dot(plane->normal, area_normal(triangle)), 0);
}

TEST(PrimitiveTraitsTest, ATriangleWithoutAreaHasNoPlane) {
  EXPECT_FALSE(PrimitiveTraits<Triangle>::plane({{1, 2, 3}, {2, 4, 6}, {3, 6, 9}, 0}));
}

// Tests the case of Figure 37.15 of Hughes et al. (the source named in primitive_traits.h): if two primitives overlap,
// the ray may enter the primitive that is tested second before it enters the primitive that is tested first.
TEST(PrimitiveTraitsTest, TheNearerOfTwoOverlappingPrimitivesWinsInEitherOrder) {
  const game::Crate large{1, 10, 0, 0, 8}, small{2, 6, 0, 0, 2};  // the ray enters `large` at 6 and `small` at 5
  for (const bool large_first : {true, false}) {
    ListIndex<game::Crate> index;
    index.insert(large_first ? large : small);
    index.insert(large_first ? small : large);
    game::Crate found{};
    double distance = 100;
    ASSERT_TRUE(first_ray(index, ray_along_x(), found, distance));
    EXPECT_EQ(found.serial, 2u);
    EXPECT_EQ(distance, 5);
  }
}

// Returns the output of the compiler for a small program whose trait lacks position().
std::string compiler_output() {
  const std::string source = testing::TempDir() + "trait_without_position_" + std::to_string(getpid()) + ".cc";
  const std::string output = source + ".txt";
  std::ofstream(source) << R"(
#include "core/geometry/primitive_traits.h"
struct Thing { unsigned number; };
template <> struct locus::PrimitiveTraits<Thing> {
  using Scalar = double;
  static uint64_t id(const Thing& thing) { return thing.number; }
  static Aabbd bounds(const Thing&) { return {}; }
};
template <locus::Bounded Value> struct Index {};
Index<Thing> index;
)";
  const std::string command = std::string(LOCUS_CXX_COMPILER) + " -std=c++20 -fsyntax-only -I" + LOCUS_SOURCE_DIR +
                              " " + source + " > " + output + " 2>&1";
  EXPECT_NE(std::system(command.c_str()), 0) << "the program should not compile";
  std::ifstream file(output);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  std::remove(source.c_str());
  std::remove(output.c_str());
  return text;
}

size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(PrimitiveTraitsTest, AMissingMemberIsOneErrorThatNamesIt) {
  const std::string output = compiler_output();
  EXPECT_NE(output.find("Traits::position(value)"), std::string::npos) << output;
  EXPECT_EQ(output.find("Traits::bounds(value)' "), std::string::npos) << output;
  EXPECT_LE(count(output, "\n"), 30u) << output;
  EXPECT_EQ(count(output, "error:"), 1u) << output;
}

}  // namespace
}  // namespace locus
