#include "core/index/bsp_tree/plane_choice.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/check.h"
#include "core/index/bsp_tree/plane_sides.h"

namespace locus {
namespace {

// Division with the lowest cost of the planes that were tried.
class BestDivision {
 public:
  explicit BestDivision(absl::Span<const Aabbd> boxes) : boxes_(boxes) {}

  void try_plane(const Plane& plane) {
    Division division = {plane, 0, 0};
    Aabbd front, back;
    for (const Aabbd& box : boxes_) {
      const Sides sides = sides_of(plane, box);
      if (sides.front) {
        ++division.front;
        front = merge(front, box);
      }
      if (sides.back) {
        ++division.back;
        back = merge(back, box);
      }
    }
    const size_t count = boxes_.size();
    const size_t most = count - std::max<size_t>(1, count / 8);
    if (std::max(division.front, division.back) > most || division.front + division.back > count + count / 2) return;
    const double cost =
        edges(front) * static_cast<double>(division.front) + edges(back) * static_cast<double>(division.back);
    if (best_ && cost >= cost_) return;
    best_ = division;
    cost_ = cost;
  }

  const std::optional<Division>& best() const { return best_; }

 private:
  static double edges(const Aabbd& box) {
    const Vec3d extent = box.extent();
    return box.empty() ? 0 : extent.x + extent.y + extent.z;
  }

  const absl::Span<const Aabbd> boxes_;
  std::optional<Division> best_;
  double cost_ = 0;
};

void try_axes(absl::Span<const Aabbd> boxes, BestDivision& best) {
  std::vector<double> centers(boxes.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < boxes.size(); ++i) centers[i] = boxes[i].min[axis] / 2 + boxes[i].max[axis] / 2;
    const auto median = centers.begin() + static_cast<std::ptrdiff_t>(centers.size() / 2);
    std::nth_element(centers.begin(), median, centers.end());
    double next = std::numeric_limits<double>::infinity();
    for (auto center = median; center != centers.end(); ++center)
      if (*center > *median) next = std::min(next, *center);
    Vec3d normal;
    normal[axis] = 1;
    best.try_plane({normal, -*median});
    if (next < std::numeric_limits<double>::infinity()) best.try_plane({normal, -(*median / 2 + next / 2)});
  }
}

}  // namespace

std::optional<Division> choose_division(absl::Span<const Aabbd> boxes, absl::Span<const Plane> offered,
                                        BspPlanes planes) {
  LOCUS_DCHECK_LT(size_t{0}, boxes.size());
  BestDivision best(boxes);
  if (planes != BspPlanes::kAxes)
    for (const Plane& plane : offered) best.try_plane(plane);
  if (planes == BspPlanes::kValues && best.best()) return best.best();
  try_axes(boxes, best);
  return best.best();
}

}  // namespace locus
