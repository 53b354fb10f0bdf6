// Rays for the kernels and their judge: every answer of an instruction set's kernels against all triangles one by one,
// bit for bit. For the tests of the kernels and for those that plant bugs in them.
#ifndef LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_
#define LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/geometry/ray_triangle.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/test_scale.h"

namespace locus::test {

struct KernelQuestion {
  Vec3d origin, direction;
  float limit = std::numeric_limits<float>::infinity();
  Cull cull = Cull::kNone;
};

struct KernelAnswer {
  float t;
  uint32_t number;
};

inline std::optional<KernelAnswer> answer_of_list(const std::vector<Triangle>& triangles,
                                                  const KernelQuestion& question) {
  const TriangleRay ray(question.origin, question.direction, question.cull);
  std::optional<KernelAnswer> best;
  for (const Triangle& triangle : triangles) {
    const std::optional<TriangleHit> found = ray.hit(triangle);
    if (!found) continue;
    const float t = ray.from_scaled(found->t);
    if (!(t <= question.limit)) continue;
    if (!best || t < best->t || (t == best->t && triangle.number < best->number))
      best = KernelAnswer{t, triangle.number};
  }
  return best;
}

inline KernelRay kernel_ray(const KernelQuestion& question) {
  return {{question.origin.x, question.origin.y, question.origin.z},
          {question.direction.x, question.direction.y, question.direction.z},
          question.limit,
          question.cull != Cull::kFront,
          question.cull != Cull::kBack,
          true};
}

// A mesh and questions to it with their answers; each that has a hit is asked again with a limit at, just behind and
// just before the hit. Immutable.
class KernelTrial {
 public:
  KernelTrial(std::string name, const std::vector<Triangle>& triangles, const std::vector<KernelQuestion>& questions)
      : name_(std::move(name)), tree_(*TriangleBvh::build(triangles)) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (KernelQuestion question : questions) {
      const std::optional<KernelAnswer> answer = answer_of_list(triangles, question);
      add(question, answer);
      if (!answer) continue;
      question.limit = answer->t;
      add(question, answer);
      question.limit = std::nextafter(answer->t, kInfinity);
      add(question, answer);
      question.limit = std::nextafter(answer->t, -kInfinity);
      if (question.limit >= 0) add(question, std::nullopt);
    }
  }

  // What is answered wrong first, empty for nothing: asked all at once, and one by one.
  std::string difference(const RayKernels& kernels) const {
    std::vector<KernelHit> first(rays_.size()), any(rays_.size());
    kernels.first(tree_.tree(), rays_.data(), first.data(), rays_.size());
    kernels.any(tree_.tree(), rays_.data(), any.data(), rays_.size());
    for (size_t i = 0; i < rays_.size(); ++i) {
      KernelHit first_alone{}, any_alone{};
      kernels.first(tree_.tree(), &rays_[i], &first_alone, 1);
      kernels.any(tree_.tree(), &rays_[i], &any_alone, 1);
      for (const std::string& what :
           {wrong_any(any[i], i), wrong_any(any_alone, i), wrong_first(first[i], i), wrong_first(first_alone, i)})
        if (!what.empty()) return absl::StrCat(name_, ", question ", i, ", ", what);
    }
    return "";
  }

  // Of the questions, asked one by one. Kernels may leave hard ones undecided, but not many.
  double undecided_share(const RayKernels& kernels) const {
    size_t undecided = 0;
    for (const KernelRay& ray : rays_) {
      KernelHit first{}, any{};
      kernels.first(tree_.tree(), &ray, &first, 1);
      kernels.any(tree_.tree(), &ray, &any, 1);
      undecided += first.verdict == KernelVerdict::kUndecided;
      undecided += any.verdict == KernelVerdict::kUndecided;
    }
    return static_cast<double>(undecided) / static_cast<double>(2 * rays_.size());
  }

 private:
  // What is wrong with the answer to question `i`; empty for nothing.
  std::string wrong_verdict(const KernelHit& hit, size_t i) const {
    if (hit.verdict == KernelVerdict::kUndecided) return "";
    if ((hit.verdict == KernelVerdict::kHit) == answers_[i].has_value()) return "";
    return answers_[i] ? "the hit is missed" : "nothing is hit";
  }
  std::string wrong_any(const KernelHit& hit, size_t i) const {
    const std::string what = wrong_verdict(hit, i);
    return what.empty() ? "" : absl::StrCat("any: ", what);
  }
  std::string wrong_first(const KernelHit& hit, size_t i) const {
    if (const std::string what = wrong_verdict(hit, i); !what.empty()) return absl::StrCat("first: ", what);
    if (hit.verdict != KernelVerdict::kHit) return "";
    const KernelAnswer expected = *answers_[i];
    if (hit.t != expected.t || std::signbit(hit.t)) return absl::StrCat("first: t is ", hit.t, ", not ", expected.t);
    return hit.number == expected.number ? "" : absl::StrCat("first: ", hit.number, " is hit, not ", expected.number);
  }

  void add(const KernelQuestion& question, std::optional<KernelAnswer> answer) {
    rays_.push_back(kernel_ray(question));
    answers_.push_back(answer);
  }

  std::string name_;
  TriangleBvh tree_;
  std::vector<KernelRay> rays_;
  std::vector<std::optional<KernelAnswer>> answers_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_
