#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

#include "tests/bench/queries/contains_cases.h"

namespace locus::bench::queries {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Kernel::Point_3 point_of(const float* p) { return {p[0], p[1], p[2]}; }

// CGAL's own point location: a ray along z through a tree of bounding boxes, with exact predicates.
class CgalSide : public ContainsPeer {
 public:
  // `surface` must be closed.
  explicit CgalSide(Surface surface) : surface_(std::move(surface)), side_(surface_) {}

  void contains(absl::Span<const float> points, uint8_t* answers) override {
    for (size_t i = 0; i < points.size(); i += 3)
      *answers++ = side_(point_of(&points[i])) == CGAL::ON_UNBOUNDED_SIDE ? 0 : 1;
  }

 private:
  const Surface surface_;
  const CGAL::Side_of_triangle_mesh<Surface, Kernel> side_;
};

}  // namespace

std::unique_ptr<ContainsPeer> cgal_side(const BenchMesh& mesh) {
  Surface surface;
  std::vector<Surface::Vertex_index> vertices;
  for (size_t at = 0; at < mesh.vertices.size(); at += 3)
    vertices.push_back(surface.add_vertex(point_of(&mesh.vertices[at])));
  for (size_t at = 0; at < mesh.indices.size(); at += 3) {
    const auto face =
        surface.add_face(vertices[mesh.indices[at]], vertices[mesh.indices[at + 1]], vertices[mesh.indices[at + 2]]);
    if (face == Surface::null_face()) return nullptr;
  }
  if (!CGAL::is_closed(surface)) return nullptr;
  return std::make_unique<CgalSide>(std::move(surface));
}

}  // namespace locus::bench::queries
