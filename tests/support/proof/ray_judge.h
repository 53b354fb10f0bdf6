// Verifier of answers to rays by a reference in long double, which is computed from the stored values. Used by the
// proof that no ray misses. The tolerance is e = 2^-20 (|origin in mesh axes| + mesh extent), in mesh axes:
//
// - miss: the reference hits a triangle at t, at least e within its border, and the answer has no hit up to t + e /
//   |direction|.
// - false hit: the answer names a triangle that is farther than e from the answer's point on the ray, or a triangle
//   that is culled, or a t beyond t_max.
// - undecidable: the answer is neither a miss nor a false hit, but differs from the answer of the reference with e = 0.
//
// An answer with all hits misses a triangle if the reference hits the triangle at least e within its border and the
// answer does not list the triangle. No angle is exempt: a nearly edge-on triangle is verified like any other.
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
  uint64_t hits = 0;  // number of answers with a hit
  uint64_t misses = 0;
  uint64_t false_hits = 0;
  uint64_t undecidable = 0;
  uint64_t repeats = 0;             // number of repetitions of the rays with other modes and limits
  uint64_t differing_repeats = 0;   // number of repetitions with a different answer
  std::vector<std::string> faults;  // descriptions of the first few errors

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

// One hit of an answer. If the ray hits nothing, `id` is kNoId and `t` is infinite.
struct RayRow {
  Real t;
  Id id;
  uint32_t triangle;
};

inline RayRow ray_row(const BlockResult& result, size_t row) {
  return {Real{result.t[row]}, result.ids[row], result.triangles[row]};
}

// Verifier of the answer to one ray of a block.
class RayJudge {
 public:
  RayJudge(const ProofScene& scene, const OwnedBlock& block, size_t ray)
      : scene_(scene), t_max_(block.extras[ray]), cull_(std::get<RayColumns>(block.settings.kind).cull) {
    const auto column = [ray](const std::vector<float>& c) {
      return Vec3d{c[3 * ray], c[3 * ray + 1], c[3 * ray + 2]};
    };
    // Compute the origin like the server: frame + offset, rounded once.
    ray_ = {to_real(block.settings.frame + column(block.points)), to_real(column(block.sizes))};
  }

  // Result of a verification, in order of severity.
  enum class Verdict { kRight, kUndecidable, kFalseHit, kMiss };

  // Verifies an answer with the first hit.
  Verdict judge_first(const RayRow& answer) const {
    const bool hit = answer.id != kNoId;
    Verdict verdict = hit ? judge_row(answer) : Verdict::kRight;
    for (const ProofInstance& instance : scene_.instances)
      verdict = std::max(verdict, judge_before(instance, hit ? answer.t : kForever));
    return verdict;
  }

  // Verifies the rows `begin` to `end` - 1, which are an answer with all hits: each row must be right, and no row may
  // be missing.
  Verdict judge_all(const BlockResult& answer, size_t begin, size_t end) const {
    Verdict verdict = Verdict::kRight;
    for (size_t row = begin; row < end; ++row) verdict = std::max(verdict, judge_row(ray_row(answer, row)));
    for (const ProofInstance& instance : scene_.instances) {
      const Placed in = placed(instance);
      instance.mesh->reference.visit(in.ray, t_max_, [&](uint32_t number, const Meeting& meeting) {
        for (size_t row = begin; row < end; ++row)
          if (answer.ids[row] == instance.id && answer.triangles[row] == number) return;
        verdict = std::max(verdict, judge_missing(in, meeting, t_max_));
      });
    }
    return verdict;
  }

 private:
  static constexpr Real kForever = std::numeric_limits<Real>::infinity();

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

  // Verifies the triangle that the row names.
  Verdict judge_row(const RayRow& row) const {
    const auto instance = std::find_if(scene_.instances.begin(), scene_.instances.end(),
                                       [&](const ProofInstance& i) { return i.id == row.id; });
    if (instance == scene_.instances.end() || row.triangle >= instance->mesh->reference.size())
      return Verdict::kFalseHit;
    if (!(row.t >= 0 && row.t <= t_max_)) return Verdict::kFalseHit;
    const Placed in = placed(*instance);
    const RealTriangle& triangle = instance->mesh->reference.triangle(row.triangle);
    const Real slope = triangle.slope(in.ray);
    if (culled(slope) || triangle.distance(in.ray.origin + in.ray.direction * row.t) > in.e) return Verdict::kFalseHit;
    const std::optional<Meeting> meeting = triangle.meet(in.ray, kForever);
    return meeting && meeting->inset >= 0 ? Verdict::kRight : Verdict::kUndecidable;
  }

  // Returns the verdict on a triangle that is missing in an answer although the ray meets the triangle's plane at
  // `meeting`, according to the reference. The answer should contain all hits up to t = `end`.
  Verdict judge_missing(const Placed& in, const Meeting& meeting, Real end) const {
    if (meeting.inset < 0 || culled(meeting.slope)) return Verdict::kRight;
    const bool within = meeting.inset >= in.e && meeting.t + in.e / in.speed < end;
    return within ? Verdict::kMiss : Verdict::kUndecidable;
  }

  // Verifies that the first hit at `t` is not too late: the reference must not hit any triangle of the instance earlier
  // by more than the tolerance.
  Verdict judge_before(const ProofInstance& instance, Real t) const {
    const Placed in = placed(instance);
    const Real limit = t < kForever ? t - in.e / in.speed : t_max_;
    Verdict verdict = Verdict::kRight;
    instance.mesh->reference.visit(in.ray, limit, [&](uint32_t, const Meeting& meeting) {
      verdict = std::max(verdict, judge_missing(in, meeting, std::min(t, t_max_)));
    });
    return verdict;
  }

  const ProofScene& scene_;
  const Real t_max_;
  const Cull cull_;
  RealRay ray_;
};

namespace internal {

inline std::string describe(const OwnedBlock& block, size_t ray) {
  const float *o = &block.points[3 * ray], *d = &block.sizes[3 * ray];
  const Vec3d frame = block.settings.frame;
  return absl::StrFormat("frame %a %a %a, origin %a %a %a, direction %a %a %a, t_max %a", frame.x, frame.y, frame.z,
                         o[0], o[1], o[2], d[0], d[1], d[2], block.extras[ray]);
}

inline void count(RayJudge::Verdict verdict, const OwnedBlock& block, size_t ray, RayTally& tally) {
  ++tally.rays;
  tally.misses += verdict == RayJudge::Verdict::kMiss;
  tally.false_hits += verdict == RayJudge::Verdict::kFalseHit;
  tally.undecidable += verdict == RayJudge::Verdict::kUndecidable;
  if (verdict == RayJudge::Verdict::kMiss) tally.note("miss: " + describe(block, ray));
  if (verdict == RayJudge::Verdict::kFalseHit) tally.note("false hit: " + describe(block, ray));
}

}  // namespace internal

// Verifies the answer to a block of rays of mode kFirst.
inline RayTally judge_first_hits(const ProofScene& scene, const OwnedBlock& block, const BlockResult& result) {
  RayTally tally;
  for (size_t i = 0; i < result.t.size(); ++i) {
    internal::count(RayJudge(scene, block, i).judge_first(ray_row(result, i)), block, i, tally);
    tally.hits += result.ids[i] != kNoId;
  }
  return tally;
}

// Verifies the answer to a block of rays of mode kAll. Precondition: the answer to no ray was truncated.
inline RayTally judge_all_hits(const ProofScene& scene, const OwnedBlock& block, const BlockResult& result) {
  RayTally tally;
  for (size_t i = 0, row = 0; i < result.counts.size(); row += result.counts[i++]) {
    internal::count(RayJudge(scene, block, i).judge_all(result, row, row + result.counts[i]), block, i, tally);
    tally.hits += result.counts[i] != 0;
  }
  return tally;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_RAY_JUDGE_H_
