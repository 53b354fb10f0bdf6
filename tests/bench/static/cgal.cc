#include "tests/bench/static/cgal.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <boost/function_output_iterator.hpp>
#include <cmath>

namespace locus::bench {
namespace {

using Kernel = CGAL::Simple_cartesian<float>;
using Surface = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Surface::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point_of(Vec3f v) { return {v.x, v.y, v.z}; }
Kernel::Vector_3 vector_of(Vec3f v) { return {v.x, v.y, v.z}; }

class Cgal : public Peer {
 public:
  explicit Cgal(const BenchMesh& mesh) : Peer("cgal"), diagonal_(mesh.diagonal) {
    surface_.reserve(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles)
      surface_.emplace_back(point_of(triangle.a), point_of(triangle.b), point_of(triangle.c));
    tree_.insert(surface_.cbegin(), surface_.cend());
    tree_.build();
  }
  bool does(Task task) const override { return task != Task::kBall && task != Task::kAll; }
  bool slow() const override { return true; }
  std::string known_fault(Task) const override { return "CGAL decides and constructs in float here, without a filter"; }

  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    for (const RayQuery& ray : rays) *answers++ = first_of(ray);
  }
  void any(absl::Span<const RayQuery> rays, uint8_t* answers) override {
    for (const RayQuery& ray : rays) {
      const Kernel::Point_3 from = point_of(ray.origin);
      const Kernel::Segment_3 segment(from, from + vector_of(ray.direction * std::min(ray.t_max, 2 * diagonal_)));
      *answers++ = tree_.do_intersect(segment) ? 1 : 0;
    }
  }
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Obbf& box : boxes) {
      const Aabbf ends = ends_of(box);
      uint32_t count = 0;
      const auto take = [&](const Surface::const_iterator& found) { ids[count++] = number_of(found); };
      tree_.all_intersected_primitives(Kernel::Iso_cuboid_3(point_of(ends.min), point_of(ends.max)),
                                       boost::make_function_output_iterator(take));
      *counts++ = count;
    }
  }

 private:
  uint32_t number_of(const Surface::const_iterator& found) const {
    return static_cast<uint32_t>(found - surface_.cbegin());
  }
  RayAnswer first_of(const RayQuery& ray) const {
    const Kernel::Point_3 from = point_of(ray.origin);
    const auto found = tree_.first_intersection(Kernel::Ray_3(from, vector_of(ray.direction)));
    if (!found) return {};
    const auto* const point = boost::get<Kernel::Point_3>(&found->first);
    if (point == nullptr) return {};
    const float t = std::sqrt(CGAL::squared_distance(from, *point));
    return t <= ray.t_max ? RayAnswer{t, number_of(found->second)} : RayAnswer{};
  }

  const float diagonal_;
  Surface surface_;
  Tree tree_;
};

}  // namespace

void add_cgal_peer(const BenchMesh& mesh, Needs needs, Peers& peers) {
  if (needs.rays || needs.regions) peers.push_back(std::make_unique<Cgal>(mesh));
}

}  // namespace locus::bench
