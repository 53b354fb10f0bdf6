// The moving objects of the dynamic suite. A kind, a count and fixed seeds determine the objects, which are drawn in a
// fixed order, so that the workload can be repeated in any server at any time. Only one thread uses a world.
//
// In the formulas, `next` is the next 64-bit number of a SplitMix64 generator, and f = (next >> 40) * 2^-24 is uniform
// over [0, 1). Each `next` and each f is a new draw. All arithmetic is float. A product plus a term is computed with
// one rounding (fused multiply-add). There is one generator for each of these seeds:
//   1  positions: first x and y of twenty towns, 100 + 1800 f each, even if the kind needs no towns; then the objects
//   2  velocities
//   5  radii of kMixed
//   7  ids: next >> 1
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_WORLD_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_WORLD_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

// Distribution of objects. kUniform: 2000 x 2000 x 100. kClustered: four of five objects are in towns, which are discs
// of radius 100. kFar: uniform, 1e6 away from the origin in x and y. kOneCell: 8 x 8 x 8. kBorder: coordinates are
// multiples of 8, and each tick moves an object by 8 along one axis. kGiant: uniform, the first object has the radius
// 5000. kMixed: uniform, radii 0.25 * 2^(7 f f') with two draws f and f'. kHub20, kHub60, kHub200: every second object,
// from the first on, is in a hub of 20, 60 or 200 in x and y and 20 in z around the centre; the others are uniform. All
// other radii are 0.5.
enum class Kind : uint8_t { kUniform, kClustered, kFar, kOneCell, kBorder, kGiant, kMixed, kHub20, kHub60, kHub200 };
inline constexpr std::array<Kind, 10> kKinds = {Kind::kUniform, Kind::kClustered, Kind::kFar,   Kind::kOneCell,
                                                Kind::kBorder,  Kind::kGiant,     Kind::kMixed, Kind::kHub20,
                                                Kind::kHub60,   Kind::kHub200};
const char* name_of(Kind kind);
// Returns the size of the hub in x and y; 0 if a world of this kind has no hub.
constexpr float hub_side(Kind kind) {
  return kind == Kind::kHub20 ? 20 : kind == Kind::kHub60 ? 60 : kind == Kind::kHub200 ? 200 : 0;
}
// Returns whether the object with the index `object` starts in the hub of a world with a hub.
constexpr bool starts_in_hub(size_t object) { return object % 2 == 0; }
// Returns whether all radii of a world of this kind are 0.5.
constexpr bool has_one_size(Kind kind) { return kind != Kind::kGiant && kind != Kind::kMixed; }
// Returns the count in short form, such as 10k or 1M.
std::string name_of_count(uint32_t count);

inline constexpr float kSide = 2000;

class World {
 public:
  // Makes a world of `count` objects. `side` is the size of a uniform world in x and y.
  World(Kind kind, uint32_t count, float side = kSide);

  // Advances by one tick: every object moves by its velocity. If it would leave the world along an axis, its velocity
  // along that axis is reversed first.
  void step();
  // Advances one object, given by its index, by one tick.
  void step(uint32_t object);

  Kind kind() const { return kind_; }
  uint32_t count() const { return static_cast<uint32_t>(ids_.size()); }
  // Returns views of the world's columns: valid as long as the world, and updated by each step().
  Objects objects() const { return {ids_, positions_, radii_}; }
  Moves moves() const { return {ids_, positions_, velocities_}; }
  // Returns a name such as uniform/10k.
  std::string name() const;

 private:
  Kind kind_;
  Vec3f low_, high_;
  std::vector<uint64_t> ids_;
  std::vector<float> positions_;   // 3 per object
  std::vector<float> velocities_;  // 3 per object, per tick
  std::vector<float> radii_;
};

// Queries about a world. Centres and origins are the present positions of randomly drawn objects, moved by up to 5 on
// each axis.
struct Queries {
  std::vector<Vec3f> centers;  // seed 3: for balls, boxes and nearest
  std::vector<Rayf> rays;      // seed 4: drawn directions with z times 0.2, then normalised; length kRayLength
};
inline constexpr size_t kQueries = 10'000;
Queries queries_of(const World& world, size_t count = kQueries);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_WORLD_H_
