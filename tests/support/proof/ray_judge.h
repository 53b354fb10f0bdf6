// Judges answers to rays by a reference in long double that starts from the stored values. For the proof that no ray
// misses. With e = 2^-20 (|origin in mesh axes| + mesh extent), in mesh axes:
//
// - miss: the reference hits a triangle at least e within its border, and the answer has no hit up to there plus
//   e / |direction|.
// - false hit: the answer names a triangle that is farther than e from the answer's place on the ray, or one that is
//   culled, or a t beyond t_max.
// - undecidable: the answer differs from what the reference finds without e, and neither of these two. It also holds
//   hits at less than 2^-28 of a right angle, where the rounding of the ray itself to double, 2^-50 of the reach, moves
//   the hit by more than e may allow.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_RAY_JUDGE_H_
#define LOCUS_TESTS_SUPPORT_PROOF_RAY_JUDGE_H_

#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "tests/support/proof/proof_scenes.h"
#include "tests/support/small_world.h"

namespace locus::test {

struct RayTally {
  uint64_t rays = 0;
  uint64_t hits = 0;  // the answer has one
  uint64_t misses = 0;
  uint64_t false_hits = 0;
  uint64_t undecidable = 0;
  uint64_t repeats = 0;             // the same rays by ANY, by ALL, with limits at their hits
  uint64_t differing_repeats = 0;   // that answered otherwise
  std::vector<std::string> faults;  // the first few, described

  void add(const RayTally& other) {
    rays += other.rays;
    hits += other.hits;
    misses += other.misses;
    false_hits += other.false_hits;
    undecidable += other.undecidable;
    repeats += other.repeats;
    differing_repeats += other.differing_repeats;
    for (const std::string& fault : other.faults) note(fault);
  }
  void note(std::string fault) {
    if (faults.size() < 10) faults.push_back(std::move(fault));
  }
  bool clean() const { return misses == 0 && false_hits == 0 && differing_repeats == 0; }
};

struct RayAnswerRow {
  Real t;  // +inf: no hit
  Id id;
  uint32_t triangle;
};

// One ray of a block against the instances of a scene.
class RayJudge {
 public:
  RayJudge(const ProofScene& scene, const OwnedBlock& block, size_t ray, RayAnswerRow answer)
      : scene_(scene), answer_(answer), t_max_(block.extras.empty() ? kForever : Real{block.extras[ray]}) {
    const auto column = [ray](const std::vector<float>& c) {
      return Vec3d{c[3 * ray], c[3 * ray + 1], c[3 * ray + 2]};
    };
    // A position is frame plus offset, rounded once.
    ray_ = {to_real(block.settings.frame + column(block.points)), to_real(column(block.sizes))};
    cull_ = std::get<RayColumns>(block.settings.kind).cull;
  }

  enum class Verdict { kRight, kMiss, kFalseHit, kUndecidable };
  Verdict judge() const {
    const bool hit = answer_.t < kForever;
    Verdict verdict = hit ? judge_hit() : Verdict::kRight;
    for (const ProofInstance& instance : scene_.instances) {
      if (verdict == Verdict::kMiss || verdict == Verdict::kFalseHit) return verdict;
      const Verdict before = judge_before(instance);
      if (before != Verdict::kRight) verdict = before;
    }
    return verdict;
  }

 private:
  static constexpr Real kForever = std::numeric_limits<Real>::infinity();
  static constexpr Real kLeastSine = 0x1p-28L;

  struct Placed {
    RealRay ray;
    Real e, speed;
  };
  Placed placed(const ProofInstance& instance) const {
    const Transform& transform = instance.transform;
    const auto to_mesh = [&](Vec3r v) { return turned_back(transform.quaternion, v) * (1 / Real{transform.scale}); };
    const RealRay ray = {to_mesh(ray_.origin - to_real(transform.translation)), to_mesh(ray_.direction)};
    return {ray, 0x1p-20L * (length(ray.origin) + instance.mesh->extent), length(ray.direction)};
  }
  bool culled(Real slope) const { return cull_ != Cull::kNone && (cull_ == Cull::kBack) == (slope > 0); }

  // The triangle that the answer names.
  Verdict judge_hit() const {
    const auto instance = std::find_if(scene_.instances.begin(), scene_.instances.end(),
                                       [this](const ProofInstance& i) { return i.id == answer_.id; });
    if (instance == scene_.instances.end() || answer_.triangle >= instance->mesh->reference.size())
      return Verdict::kFalseHit;
    if (!(answer_.t >= 0 && answer_.t <= t_max_)) return Verdict::kFalseHit;
    const Placed in = placed(*instance);
    const RealTriangle& triangle = instance->mesh->reference.triangle(answer_.triangle);
    const Real slope = triangle.slope(in.ray);
    if (std::fabs(slope) < kLeastSine * in.speed) return Verdict::kUndecidable;
    if (culled(slope) || triangle.distance(in.ray.origin + in.ray.direction * answer_.t) > in.e)
      return Verdict::kFalseHit;
    const std::optional<Meeting> meeting = triangle.meet(in.ray, kForever);
    return meeting && meeting->inset >= 0 ? Verdict::kRight : Verdict::kUndecidable;
  }

  // What the reference hits so much before the answer that the answer is late.
  Verdict judge_before(const ProofInstance& instance) const {
    const Placed in = placed(instance);
    const Real allowance = in.e / in.speed;
    const Real end = std::min(answer_.t, t_max_);
    Verdict verdict = Verdict::kRight;
    const Real limit = answer_.t < kForever ? end - allowance : end;
    instance.mesh->reference.visit(in.ray, limit, [&](uint32_t, const Meeting& meeting) {
      if (meeting.inset < 0 || culled(meeting.slope) || verdict == Verdict::kMiss) return;
      const bool within = meeting.inset >= in.e && meeting.t + allowance < end;
      const bool clear = std::fabs(meeting.slope) >= kLeastSine * in.speed;
      verdict = within && clear ? Verdict::kMiss : Verdict::kUndecidable;
    });
    return verdict;
  }

  const ProofScene& scene_;
  const RayAnswerRow answer_;
  const Real t_max_;
  RealRay ray_;
  Cull cull_;
};

namespace internal {

inline std::string describe(const OwnedBlock& block, size_t ray, const RayAnswerRow& row) {
  const float *o = &block.points[3 * ray], *d = &block.sizes[3 * ray];
  const Vec3d frame = block.settings.frame;
  return absl::StrFormat("frame %a %a %a, origin %a %a %a, direction %a %a %a, t_max %a: t %a, id %d, triangle %d",
                         frame.x, frame.y, frame.z, o[0], o[1], o[2], d[0], d[1], d[2], block.extras[ray],
                         static_cast<double>(row.t), row.id, row.triangle);
}

}  // namespace internal

// Judges the answer to a block of rays of mode kFirst.
inline RayTally judge_rays(const ProofScene& scene, const OwnedBlock& block, const BlockResult& result) {
  RayTally tally;
  for (size_t i = 0; i < result.t.size(); ++i) {
    const RayAnswerRow row = {Real{result.t[i]}, result.ids[i], result.triangles[i]};
    const RayJudge::Verdict verdict = RayJudge(scene, block, i, row).judge();
    ++tally.rays;
    tally.hits += row.id != kNoId;
    tally.misses += verdict == RayJudge::Verdict::kMiss;
    tally.false_hits += verdict == RayJudge::Verdict::kFalseHit;
    tally.undecidable += verdict == RayJudge::Verdict::kUndecidable;
    if (verdict == RayJudge::Verdict::kMiss) tally.note("miss: " + internal::describe(block, i, row));
    if (verdict == RayJudge::Verdict::kFalseHit) tally.note("false hit: " + internal::describe(block, i, row));
  }
  return tally;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_RAY_JUDGE_H_
