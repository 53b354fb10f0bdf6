#include "tests/bench/dynamic/agreement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "core/geometry/shape.h"

namespace locus::bench::dynamic {
namespace {

// Answers to one query.
struct Part {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> distances;  // empty if the task has no distances
};

Part part_of(const Answers& answers, size_t begin, size_t count) {
  const absl::Span<const float> distances = answers.distances;
  return {absl::MakeConstSpan(answers.ids).subspan(begin, count),
          distances.empty() ? distances : distances.subspan(begin, count)};
}

bool are_as_far(Task task, const Part& a, const Part& b) {
  if (a.ids.size() != b.ids.size()) return false;
  const float tolerance = task == Task::kNearest ? kSameNearDistance : kSameDistance;
  for (size_t i = 0; i < a.distances.size(); ++i)
    if (std::fabs(a.distances[i] - b.distances[i]) > tolerance) return false;
  return true;
}

bool is_same(Task task, const Part& a, const Part& b) {
  if (!are_as_far(task, a, b)) return false;
  const auto sum = [](absl::Span<const uint64_t> ids) { return std::accumulate(ids.begin(), ids.end(), uint64_t{0}); };
  return sum(a.ids) == sum(b.ids);
}

Shape shape_of(const Objects& objects, size_t i) {
  Shape shape;
  shape.kind = ShapeKind::kBall;
  shape.position = to_double(point_at(objects.positions, i));
  shape.radius = objects.radii[i];
  return shape;
}

std::vector<uint64_t> true_region(const World& world, Task task, Vec3f center) {
  const Objects objects = world.objects();
  Obbd box;
  box.center = to_double(center);
  box.half = {kReach, kReach, kReach};
  std::vector<uint64_t> ids;
  for (size_t i = 0; i < objects.ids.size(); ++i) {
    const Shape shape = shape_of(objects, i);
    const bool meets = task == Task::kBall ? ball_overlaps(Balld{box.center, kReach}, shape) : box_overlaps(box, shape);
    if (meets) ids.push_back(objects.ids[i]);
  }
  return ids;
}

std::vector<uint64_t> true_ray(const World& world, const Rayf& ray) {
  const Objects objects = world.objects();
  const ObjectRay prepared({to_double(ray.origin), to_double(ray.direction), kRayLength});
  double nearest = kRayLength;
  std::vector<uint64_t> ids;
  for (size_t i = 0; i < objects.ids.size(); ++i) {
    const auto hit = ray_hit(prepared, shape_of(objects, i));
    if (!hit || hit->t > nearest || (hit->t == nearest && (ids.empty() || ids[0] < objects.ids[i]))) continue;
    nearest = hit->t;
    ids = {objects.ids[i]};
  }
  return ids;
}

std::vector<uint64_t> true_nearest(const World& world, Vec3f center) {
  const Objects objects = world.objects();
  std::vector<std::pair<double, uint64_t>> all;
  for (size_t i = 0; i < objects.ids.size(); ++i)
    all.emplace_back(distance(to_double(center), shape_of(objects, i)), objects.ids[i]);
  const size_t count = std::min<size_t>(kNearestCount, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<ptrdiff_t>(count), all.end());
  std::vector<uint64_t> ids;
  for (size_t i = 0; i < count; ++i) ids.push_back(all[i].second);
  return ids;
}

std::vector<uint64_t> truth_of(const World& world, Task task, const Queries& queries, size_t query) {
  if (task == Task::kRay) return true_ray(world, queries.rays[query]);
  if (task == Task::kNearest) return true_nearest(world, queries.centers[query]);
  return true_region(world, task, queries.centers[query]);
}

bool is_right(const World& world, Task task, const Queries& queries, size_t query, const Part& ours) {
  std::vector<uint64_t> truth = truth_of(world, task, queries, query);
  std::vector<uint64_t> given(ours.ids.begin(), ours.ids.end());
  if (task != Task::kNearest) {  // the order of nearest objects is part of the answer
    std::sort(truth.begin(), truth.end());
    std::sort(given.begin(), given.end());
  }
  return truth == given;
}

}  // namespace

void compare(const std::string& case_name, Task task, const World& world, const Queries& queries, const Answers& ours,
             const std::string& peer, const Answers& theirs, Report& report) {
  const size_t count = ours.counts.size();
  const size_t limit = std::max<size_t>(1, count * kDifferingQueries / kDifferingQueriesOf);
  size_t differ = 0, our_begin = 0, their_begin = 0, first = 0;
  for (size_t i = 0; i < count && differ <= limit; ++i) {
    const Part our_part = part_of(ours, our_begin, ours.counts[i]);
    const Part their_part = part_of(theirs, their_begin, theirs.counts[i]);
    our_begin += ours.counts[i];
    their_begin += theirs.counts[i];
    if (is_same(task, our_part, their_part)) continue;
    if (!is_right(world, task, queries, i, our_part)) {
      report.disagreements.push_back(absl::StrCat(case_name, ", query ", i, ": ours is wrong; ", peer, " differs"));
      return;
    }
    if (task == Task::kNearest && are_as_far(task, our_part, their_part)) continue;  // ties
    if (differ++ == 0) first = i;
  }
  if (differ == 0) return;
  const std::string words = absl::StrCat(case_name, ": ", peer, " is wrong in ", differ > limit ? "more than " : "",
                                         std::min(differ, limit), " of ", count, " queries, first in query ", first);
  (differ > limit ? report.disagreements : report.notes).push_back(words);
}

}  // namespace locus::bench::dynamic
