// Cases of the suite `queries` on 100,000 moving objects: pairs within a distance, cells of free space, and objects in
// frustums. The peers are Bullet's btDbvt for pairs and frustums, a ball query around each object for pairs, and a test
// of all objects for cells.
#ifndef LOCUS_TESTS_BENCH_QUERIES_OBJECT_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_OBJECT_CASES_H_

#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::queries {

inline constexpr float kPairDistance = 10;
inline constexpr size_t kFrustumPlanes = 6;

// Ids of two objects, the lower first.
struct ObjectPair {
  uint64_t id = 0;
  uint64_t other = 0;

  friend constexpr auto operator<=>(const ObjectPair&, const ObjectPair&) = default;
};

// Another library that holds all objects of a world.
class ObjectPeer {
 public:
  virtual ~ObjectPeer() = default;
  // Appends all pairs of balls at most kPairDistance apart, in any order.
  virtual void pairs(std::vector<ObjectPair>& pairs) = 0;
  // Appends the ids of the balls that intersect a frustum, in any order. `planes` has (nx, ny, nz, d) for each of
  // kFrustumPlanes planes.
  virtual void frustum(const float* planes, std::vector<uint64_t>& ids) = 0;
};

// Returns a peer that uses Bullet. It keeps a copy of `objects`.
std::unique_ptr<ObjectPeer> bullet_objects(const dynamic::Objects& objects);

void run_object_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_OBJECT_CASES_H_
