// Uploaded triangle mesh, validated at creation: vertices are finite and within the world, indices refer to existing
// vertices, and there is at least one triangle. Immutable after creation; any thread.
#ifndef LOCUS_CORE_MESH_TRIANGLE_MESH_H_
#define LOCUS_CORE_MESH_TRIANGLE_MESH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle.h"

namespace locus {

// Named range of triangles: from `first_triangle` to the first triangle of the next part, or to the end of the mesh.
struct MeshPart {
  std::string name;
  uint32_t first_triangle = 0;

  bool operator==(const MeshPart&) const = default;
};

// Checks the parts of a mesh of `triangles` triangles: their number, the lengths of their names, and that their first
// triangles begin at 0, ascend and lie within the mesh. Returns INVALID_ARGUMENT naming the part or the exceeded limit.
absl::Status check_parts(const std::vector<MeshPart>& parts, size_t triangles);

class TriangleMesh {
 public:
  // Creates a mesh from the coordinates of V vertices and the vertex indices of T triangles, three numbers each.
  // `parts` may be empty; otherwise the first part must begin at triangle 0. Returns INVALID_ARGUMENT if the arguments
  // are invalid. The error names the exceeded limit, or else the field (`vertices`, `indices` or `parts`) and the
  // invalid vertex, triangle or part. O(V + T).
  static absl::StatusOr<TriangleMesh> create(std::vector<float> vertices, std::vector<uint32_t> indices,
                                             std::vector<MeshPart> parts);

  uint32_t triangle_count() const { return static_cast<uint32_t>(indices_.size() / 3); }
  // Returns the number of triangles without area. No ray hits them, but they stay in the mesh, so that the other
  // triangles keep their numbers.
  uint32_t zero_area_count() const { return zero_area_count_; }
  const Aabbf& bounds() const { return bounds_; }
  const std::vector<float>& vertices() const { return vertices_; }
  const std::vector<uint32_t>& indices() const { return indices_; }
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns the triangle with the number `index`. Precondition: `index` < triangle_count().
  Triangle triangle(uint32_t index) const;
  uint64_t bytes() const { return vertices_.size() * sizeof(float) + indices_.size() * sizeof(uint32_t); }

 private:
  TriangleMesh() = default;
  // Checks the sizes of the arrays and that the bounds are not empty. O(1).
  void check_invariants() const;

  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  std::vector<MeshPart> parts_;
  Aabbf bounds_;
  uint32_t zero_area_count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_MESH_TRIANGLE_MESH_H_
