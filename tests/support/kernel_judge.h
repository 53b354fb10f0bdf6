// Queries for the ray kernels, and verification of the answers: every answer of a kernel is compared, bit for bit, with
// a test of all triangles, unless the kernel left the query undecided. Used by the tests of the kernels and by tests of
// planted bugs in the kernels.
#ifndef LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_
#define LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
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

// Rows of all hits in ascending order of t, then of triangle number.
using KernelAnswer = std::vector<KernelRow>;

inline void sort_rows(absl::Span<KernelRow> rows) {
  std::sort(rows.begin(), rows.end(),
            [](const KernelRow& a, const KernelRow& b) { return std::tie(a.t, a.number) < std::tie(b.t, b.number); });
}

inline KernelAnswer answer_of_list(const std::vector<Triangle>& triangles, const KernelQuestion& question) {
  const TriangleRay ray(question.origin, question.direction, question.cull);
  KernelAnswer answer;
  for (const Triangle& triangle : triangles) {
    const std::optional<TriangleHit> found = ray.hit(triangle);
    if (!found) continue;
    const float t = ray.from_scaled(found->t);
    if (t <= question.limit) answer.push_back({t, triangle.number});
  }
  sort_rows(absl::MakeSpan(answer));
  return answer;
}

inline KernelRay kernel_ray(const KernelQuestion& question) {
  return {{question.origin.x, question.origin.y, question.origin.z},
          {question.direction.x, question.direction.y, question.direction.z},
          question.limit,
          question.cull != Cull::kFront,
          question.cull != Cull::kBack,
          true};
}

// A mesh, queries on it, and the expected answers. Each query that has a hit is repeated with three limits: the t of
// the nearest hit, the next greater float and the next smaller float. Immutable.
class KernelTrial {
 public:
  KernelTrial(std::string name, const std::vector<Triangle>& triangles, const std::vector<KernelQuestion>& questions)
      : KernelTrial(std::move(name), triangles, questions, *TriangleBvh::build(triangles)) {}
  // Makes a trial that queries `tree`, which must be a tree of `triangles`, instead of a tree built from `triangles`.
  KernelTrial(std::string name, const std::vector<Triangle>& triangles, const std::vector<KernelQuestion>& questions,
              TriangleBvh tree)
      : name_(std::move(name)), tree_(std::move(tree)) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (KernelQuestion question : questions) {
      const KernelAnswer answer = answer_of_list(triangles, question);
      add(question, answer);
      if (answer.empty()) continue;
      const float nearest = answer.front().t;
      for (const float limit : {nearest, std::nextafter(nearest, kInfinity), std::nextafter(nearest, -kInfinity)}) {
        question.limit = limit;
        if (limit >= 0) add(question, answer);
      }
    }
  }

  // Runs all queries in one call and each query in a call of its own. Returns the first wrong answer; empty if there is
  // none.
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
    for (const uint32_t most : {1u, 3u, 100u})
      if (const std::string what = difference_of_all(kernels, most); !what.empty()) return what;
    return "";
  }

  // Runs each query in a call of its own and returns the share of undecided answers. Kernels may leave only few queries
  // undecided.
  double undecided_share(const RayKernels& kernels) const {
    size_t undecided = 0;
    for (const KernelRay& ray : rays_) {
      KernelHit first{}, any{}, all{};
      KernelRow row{};
      kernels.first(tree_.tree(), &ray, &first, 1);
      kernels.any(tree_.tree(), &ray, &any, 1);
      kernels.all(tree_.tree(), &ray, &all, 1, &row, 1);
      for (const KernelHit& hit : {first, any, all}) undecided += hit.verdict == KernelVerdict::kUndecided;
    }
    return static_cast<double>(undecided) / static_cast<double>(3 * rays_.size());
  }

 private:
  // Returns the error in the answer to query `i`; empty if the answer is right.
  std::string wrong_verdict(const KernelHit& hit, size_t i) const {
    if (hit.verdict == KernelVerdict::kUndecided) return "";
    if ((hit.verdict == KernelVerdict::kHit) == !answers_[i].empty()) return "";
    return answers_[i].empty() ? "nothing is hit" : "the hit is missed";
  }
  std::string wrong_any(const KernelHit& hit, size_t i) const {
    const std::string what = wrong_verdict(hit, i);
    return what.empty() ? "" : absl::StrCat("any: ", what);
  }
  std::string wrong_first(const KernelHit& hit, size_t i) const {
    if (const std::string what = wrong_verdict(hit, i); !what.empty()) return absl::StrCat("first: ", what);
    if (hit.verdict != KernelVerdict::kHit) return "";
    const KernelRow expected = answers_[i].front();
    if (hit.t != expected.t || std::signbit(hit.t)) return absl::StrCat("first: t is ", hit.t, ", not ", expected.t);
    return hit.number == expected.number ? "" : absl::StrCat("first: ", hit.number, " is hit, not ", expected.number);
  }

  // Runs RayKernels::all with at most `most` rows per query, for all queries in one call and for each query in a call
  // of its own. Returns the first wrong answer; empty if there is none.
  std::string difference_of_all(const RayKernels& kernels, uint32_t most) const {
    std::vector<KernelHit> hits(rays_.size());
    std::vector<KernelRow> rows(rays_.size() * most), rows_alone(most);
    kernels.all(tree_.tree(), rays_.data(), hits.data(), rays_.size(), rows.data(), most);
    for (size_t i = 0; i < rays_.size(); ++i) {
      KernelHit alone{};
      kernels.all(tree_.tree(), &rays_[i], &alone, 1, rows_alone.data(), most);
      for (const std::string& what : {wrong_all(hits[i], absl::MakeSpan(rows).subspan(i * most, most), i),
                                      wrong_all(alone, absl::MakeSpan(rows_alone), i)})
        if (!what.empty()) return absl::StrCat(name_, ", question ", i, ", at most ", most, ", ", what);
    }
    return "";
  }
  std::string wrong_all(const KernelHit& hit, absl::Span<KernelRow> rows, size_t i) const {
    if (const std::string what = wrong_verdict(hit, i); !what.empty()) return absl::StrCat("all: ", what);
    if (hit.verdict == KernelVerdict::kUndecided) return "";
    const size_t expected = std::min(answers_[i].size(), rows.size());
    if (hit.number != expected) return absl::StrCat("all: ", hit.number, " rows, not ", expected);
    sort_rows(rows.first(expected));
    for (size_t row = 0; row < expected; ++row) {
      const KernelRow &is = rows[row], &should = answers_[i][row];
      if (is.t != should.t || std::signbit(is.t) || is.number != should.number)
        return absl::StrCat("all: row ", row, " is ", is.number, " at ", is.t, ", not ", should.number, " at ",
                            should.t);
    }
    return "";
  }

  // Adds a query. `answer` may contain hits beyond the limit of the query, which are removed.
  void add(const KernelQuestion& question, KernelAnswer answer) {
    while (!answer.empty() && answer.back().t > question.limit) answer.pop_back();
    rays_.push_back(kernel_ray(question));
    answers_.push_back(std::move(answer));
  }

  std::string name_;
  TriangleBvh tree_;
  std::vector<KernelRay> rays_;
  std::vector<KernelAnswer> answers_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_KERNEL_JUDGE_H_
