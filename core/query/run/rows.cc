#include "core/query/run/rows.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/query/kinds/overlap_contact.h"

namespace locus {
namespace {

// Columns of a row that objects and instances have in common.
struct Labels {
  Group group = 0;
  Tag tag = 0;
  Layers layers = 0;
  Vec3d position;
  Quaternion rotation{0, 0, 0, 0};
};

Labels labels_of(const Hit& hit) {
  if (hit.object) {
    const GridEntry& entry = hit.object.entry();
    const Shape shape = hit.whole_shape();
    Layers layers = entry.layers;
    if (shape.kind == ShapeKind::kCompound && hit.triangle != kNoTriangle)
      layers &= compound_of(hit.object)->parts()[hit.triangle].layers;
    return {entry.group, entry.tag, layers, shape.position, shape.rotation};
  }
  if (hit.instance != nullptr)
    return {hit.instance->group, hit.instance->tag, hit.instance->layers, hit.instance->transform.translation,
            hit.instance->transform.quaternion};
  return {};
}

template <class T, class V>
void write_point(T* column, size_t row, V x, V y, V z) {
  column += 3 * row;
  column[0] = x;
  column[1] = y;
  column[2] = z;
}

// Writes the columns SHAPE. The numbers of the shapes are those of the protocol's BlockResult.shapes.
void write_shape(const Hit& hit, const RowSpans& to, size_t row) {
  constexpr uint32_t kInstanceShape = 5, kCompoundShape = 6;
  uint32_t kind = 0;
  std::array<float, 4> sizes = {};
  if (hit.object) {
    const Shape shape = hit.whole_shape();
    if (const Compound* const compound = compound_of(hit.object)) {
      kind = kCompoundShape;
      sizes = {compound->extent(), static_cast<float>(compound->parts().size())};
    } else {
      kind = static_cast<uint32_t>(shape.kind) + 1;
      sizes = {shape.radius, shape.size.x, shape.size.y, shape.size.z};
    }
  } else if (hit.instance != nullptr) {
    kind = kInstanceShape;
    sizes[0] = hit.instance->transform.scale;
  }
  to.shapes[row] = kind;
  std::copy_n(sizes.begin(), 4, to.sizes + 4 * row);
}

void write_labels(const Hit& hit, const RowSpans& to, size_t row) {
  if (to.shapes != nullptr) write_shape(hit, to, row);
  const Labels labels = labels_of(hit);
  if (to.groups != nullptr) to.groups[row] = labels.group;
  if (to.tags != nullptr) to.tags[row] = labels.tag;
  if (to.layers != nullptr) to.layers[row] = labels.layers;
  if (to.positions == nullptr) return;
  write_point(to.positions, row, labels.position.x, labels.position.y, labels.position.z);
  const Quaternion& rotation = labels.rotation;
  std::copy_n(std::array{rotation.x, rotation.y, rotation.z, rotation.w}.begin(), 4, to.rotations + 4 * row);
}

bool has_labels(const RowSpans& to) {
  return to.groups != nullptr || to.tags != nullptr || to.layers != nullptr || to.positions != nullptr ||
         to.shapes != nullptr;
}

}  // namespace

void write_row(const Hit& hit, const RowSpans& to, size_t row) {
  if (to.t != nullptr) to.t[row] = hit.t;
  if (to.ids != nullptr) to.ids[row] = hit.id;
  if (to.triangles != nullptr) to.triangles[row] = hit.triangle;
  if (has_labels(to)) write_labels(hit, to, row);
}

void write_miss(const RowSpans& to, size_t row) {
  write_row(Hit(), to, row);
  write_no_surface(to, row);
}

void write_no_surface(const RowSpans& to, size_t row) {
  if (to.uvs != nullptr) std::fill_n(to.uvs + 2 * row, 2, 0.0f);
  if (to.normals != nullptr) std::fill_n(to.normals + 3 * row, 3, 0.0f);
  if (to.points != nullptr) std::fill_n(to.points + 3 * row, 3, 0.0f);
}

void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row) {
  if (to.ids != nullptr) std::fill_n(to.ids + row, triangles.size(), hit.id);
  if (to.triangles != nullptr) std::copy(triangles.begin(), triangles.end(), to.triangles + row);
  if (!has_labels(to)) return;
  Hit one = hit;
  for (size_t i = 0; i < triangles.size(); ++i) {
    one.triangle = triangles[i];  // the layers of a compound's row depend on the part
    write_labels(one, to, row + i);
  }
}

void write_object_rows(absl::Span<const FoundObject> objects, const SceneAtTime& moment, const RowSpans& to) {
  if (to.ids != nullptr)
    for (size_t row = 0; row < objects.size(); ++row) to.ids[row] = objects[row].id;
  if (to.triangles != nullptr) std::fill_n(to.triangles, objects.size(), kNoTriangle);
  if (!has_labels(to)) return;
  for (size_t row = 0; row < objects.size(); ++row) write_labels(hit_on(objects[row].object, 0, moment), to, row);
}

void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row) {
  if (to.uvs != nullptr || to.normals != nullptr) {
    const Surface surface = surface_at(request, hit, winding);
    if (to.uvs != nullptr) std::copy_n(std::array{surface.u, surface.v}.begin(), 2, to.uvs + 2 * row);
    const Vec3f normal = to_float(surface.normal);
    if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
  }
  if (to.points == nullptr) return;
  Vec3f point;
  if (hit.id != kNoId) point = to_float(request.origin - frame + request.direction * double{hit.t});
  write_point(to.points, row, point.x, point.y, point.z);
}

void write_contact(const SweepRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row) {
  Vec3f normal, point;
  if (hit.id != kNoId) {
    const Contact contact = contact_of(request, hit);
    // Adding 0 turns -0 into 0, so that equal results have equal bytes.
    normal = to_float(contact.normal + Vec3d{});
    point = to_float(request.mover.start - frame + contact.point + Vec3d{});
  }
  if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
  if (to.points != nullptr) write_point(to.points, row, point.x, point.y, point.z);
}

void write_overlap_contact(const Mover& solid, Precision precision, Vec3d frame, const Hit& hit, uint32_t triangle,
                           const RowSpans& to, size_t row) {
  const Contact contact = overlap_contact(solid, precision, hit, triangle);
  // Adding 0 turns -0 into 0, so that equal results have equal bytes.
  if (to.t != nullptr) to.t[row] = static_cast<float>(contact.distance) + 0.0f;
  const Vec3f normal = to_float(contact.normal + Vec3d{});
  const Vec3f point = to_float(solid.start - frame + contact.point + Vec3d{});
  if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
  if (to.points != nullptr) write_point(to.points, row, point.x, point.y, point.z);
}

void write_cell(const CellAnswer& cell, Vec3d point, const RowSpans& to, size_t rows) {
  for (size_t row = 0; row < rows; ++row) {
    Hit hit;
    hit.t = cell.radius;
    Vec3d offset, direction;
    if (row > 0) {
      const CellPlane& plane = cell.planes[row - 1];
      hit = plane.row;
      offset = plane.offset;
      direction = plane.normal;
    }
    write_row(hit, to, row);
    const Vec3f normal = to_float(direction + Vec3d{}), at = to_float(point + offset);
    if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
    if (to.points != nullptr) write_point(to.points, row, at.x, at.y, at.z);
  }
}

void write_nearest_surface(const NearestRequest& request, Vec3d frame, const Hit& hit, Winding winding,
                           const RowSpans& to, size_t row) {
  if (to.points == nullptr && to.normals == nullptr && to.uvs == nullptr) return;
  const NearestSurface surface = nearest_surface(request, hit, winding);
  const Vec3f point = to_float(request.point - frame + surface.offset);
  const Vec3f normal = to_float(surface.normal + Vec3d{});
  if (to.points != nullptr) write_point(to.points, row, point.x, point.y, point.z);
  if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
  if (to.uvs != nullptr) std::copy_n(std::array{surface.u, surface.v}.begin(), 2, to.uvs + 2 * row);
}

}  // namespace locus
