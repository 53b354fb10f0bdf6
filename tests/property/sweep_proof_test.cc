// Proves that no sweep misses and none hits too early. Balls, capsules and boxes move past the triangles of placed
// meshes, and the answers of the query engine are compared with a search in long double. Each run tests a hundred
// thousand sweeps; the long run tests ten million, or the number in LOCUS_PROOF_SWEEPS.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "tests/support/proof/proof_tally.h"
#include "tests/support/proof/real_sweep.h"
#include "tests/support/proof/real_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kSweepSeed = 718;
constexpr size_t kSweepsOfAMesh = 300;

// One placed mesh, the random sweeps past it, and the verification of the answers.
class SweepTrial {
 public:
  explicit SweepTrial(uint64_t seed) : world_(seed, 0), random_(world_.random()) {}

  void run(ProofTally& tally) {
    for (const MoverKind kind : {MoverKind::kBall, MoverKind::kCapsule, MoverKind::kBox}) run(kind, tally);
  }

 private:
  // Adds a sweep that passes near a triangle. The path of the sweep is about as long as the distance from its start to
  // the triangle, so that the rounding of t to float stays within the documented error bound.
  void add_sweep(MoverKind kind, OwnedBlock& block) {
    const Triangle& target = random_.pick(world_.mesh());
    const double scale = world_.scale(), size = scale * random_.magnitude(-7, 1);
    const Vec3d near = world_.transform().point_to_world(to_double(target.a) * random_.unit() +
                                                         to_double(target.b) * random_.unit() * 0.5) -
                       world_.frame() + random_.vector(size);
    const Vec3d start = near + random_.vector(scale * random_.magnitude(-2, 4));
    Vec3d way = (near - start) * random_.between(0.3, 3);
    if (random_.chance(0.1)) way[random_.whole(0, 2)] = 0;
    const Vec3f from = to_float(start), to = to_float(start + way);
    block.points.insert(block.points.end(), {from.x, from.y, from.z});
    block.sizes.insert(block.sizes.end(), {to.x, to.y, to.z});
    const auto three = [&](Vec3f v, std::vector<float>& column) { column.insert(column.end(), {v.x, v.y, v.z}); };
    if (kind != MoverKind::kBox) block.extras.push_back(static_cast<float>(size * random_.between(0.01, 1)));
    if (kind == MoverKind::kCapsule) three(to_float(random_.vector(size * 2)), block.half_axes);
    if (kind != MoverKind::kBox) return;
    const auto side = [&] { return static_cast<float>(size * random_.between(0.01, 1)); };
    three({side(), side(), side()}, block.half_extents);
    const Quaternion q = random_.rotation();
    block.rotations.insert(block.rotations.end(), {q.x, q.y, q.z, q.w});
  }

  void run(MoverKind kind, ProofTally& tally) {
    OwnedBlock block;
    block.settings.kind = SweepColumns{};
    block.settings.frame = world_.frame();
    block.settings.columns = {Column::kT, Column::kId};
    for (size_t i = 0; i < kSweepsOfAMesh; ++i) add_sweep(kind, block);
    const BlockResult result = run_block(world_.snapshot(), block);
    for (size_t i = 0; i < kSweepsOfAMesh; ++i) {
      const RealMover mover = mover_of(kind, block, i);
      ++tally.queries;
      tally.found += result.ids[i] != 0 ? 1 : 0;
      std::optional<Real> found;
      if (result.ids[i] != 0) found = result.t[i];
      if (std::string fault = fault_of(mover, found); !fault.empty())
        tally.note("seed " + std::to_string(world_.seed()) + " kind " + std::to_string(static_cast<int>(kind)) +
                   " sweep " + std::to_string(i) + ": " + fault);
    }
  }

  RealMover mover_of(MoverKind kind, const OwnedBlock& block, size_t i) const {
    RealMover mover;
    mover.kind = kind;
    const auto at = [i](const std::vector<float>& column) {
      return Vec3r{column[3 * i], column[3 * i + 1], column[3 * i + 2]};
    };
    mover.start = at(block.points) + to_real(world_.frame());
    mover.way = at(block.sizes) - at(block.points);
    if (kind != MoverKind::kBox) mover.radius = block.extras[i];
    if (kind == MoverKind::kCapsule) mover.half_axis = at(block.half_axes);
    if (kind != MoverKind::kBox) return mover;
    mover.half = at(block.half_extents);
    const float* const q = &block.rotations[4 * i];
    for (int axis = 0; axis < 3; ++axis) {
      Vec3r unit_axis;
      unit_axis[axis] = 1;
      mover.axes[static_cast<size_t>(axis)] = turned({q[0], q[1], q[2], q[3]}, unit_axis);
    }
    return mover;
  }

  // Returns a description of the error in an answer; empty if there is none. The mover shrunk by e must touch nothing
  // until it is e away from the found contact. At the contact, the mover grown by e must touch a triangle. e is 2^-20
  // of the sum of the start's distance from the origin and the mover's size.
  std::string fault_of(const RealMover& mover, std::optional<Real> found) const {
    const Real e = 0x1p-20L * (length(mover.start) + mover.size()), way = length(mover.way);
    const Real before = !found ? 1 : way == 0 ? -1 : *found - e / way;
    bool touches = false;
    for (const SweptTriangle& triangle : world_.triangles()) {
      if (!triangle.is_near(mover, e)) continue;
      if (triangle.is_overlapped(mover, -e, before))
        return found ? "a contact before " + std::to_string(static_cast<double>(*found)) : std::string("a miss");
      touches = touches || (found && triangle.gap(mover, *found, e) <= 0);
    }
    if (!found || touches) return "";
    return "nothing is touched at " + std::to_string(static_cast<double>(*found));
  }

  RealWorld world_;
  Random& random_;
};

// Runs at least `sweeps` sweeps in total, on one thread for each processor, and expects that no answer is wrong.
void expect_no_fault(uint64_t sweeps) {
  const uint64_t meshes = (sweeps + 3 * kSweepsOfAMesh - 1) / (3 * kSweepsOfAMesh);
  const ProofTally all =
      run_trials(meshes, [](uint64_t i, ProofTally& tally) { SweepTrial(kSweepSeed + i).run(tally); });
  std::printf("proof: %llu sweeps past %llu meshes, %llu hits: %llu faults; seed %llu\n",
              static_cast<unsigned long long>(all.queries), static_cast<unsigned long long>(meshes),
              static_cast<unsigned long long>(all.found), static_cast<unsigned long long>(all.faults),
              static_cast<unsigned long long>(kSweepSeed));
  EXPECT_EQ(all.faults, 0u) << all.first_fault;
  EXPECT_GE(all.queries, sweeps);
  EXPECT_GT(all.found, sweeps / 4) << "too few sweeps hit to prove anything";
}

TEST(SweepProofTest, NoSweepMissesAndNoneHitsTooEarly) { expect_no_fault(scaled_count(100'000)); }

TEST(LongSweepProofTest, NoSweepMissesAndNoneHitsTooEarly) {
  const char* const text = std::getenv("LOCUS_PROOF_SWEEPS");
  expect_no_fault(text == nullptr ? 10'000'000 : static_cast<uint64_t>(std::strtod(text, nullptr)));
}

}  // namespace
}  // namespace locus::test
