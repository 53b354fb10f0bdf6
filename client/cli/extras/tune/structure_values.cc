#include "client/cli/extras/tune/structure_values.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/rows/part_list.h"
#include "client/cli/rows/scene_rows.h"
#include "core/base/status_macros.h"
#include "core/geometry/compound.h"
#include "core/geometry/transform.h"

namespace locus::cli {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

Quaternion quaternion_of(const std::array<float, 4>& q) { return {q[0], q[1], q[2], q[3]}; }
Vec3f vector_of(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

ShapeKind kind_of_part(v1::Parts::ShapeCase shape) {
  if (shape == v1::Parts::kBall) return ShapeKind::kBall;
  if (shape == v1::Parts::kBox) return ShapeKind::kBox;
  if (shape == v1::Parts::kCapsule) return ShapeKind::kCapsule;
  return ShapeKind::kPoint;
}

ShapeKind kind_of_thing(ThingKind kind) {
  if (kind == ThingKind::kBall) return ShapeKind::kBall;
  if (kind == ThingKind::kBox) return ShapeKind::kBox;
  if (kind == ThingKind::kCapsule) return ShapeKind::kCapsule;
  return ShapeKind::kPoint;
}

absl::Status too_many(const char* what, uint64_t max) {
  return absl::ResourceExhaustedError(
      absl::StrCat("--structures takes up to ", max, " ", what, " into this process; the scene has more"));
}

// Returns the vector `index` of a column that has one vector for all queries or one for each.
Vec3d at(const google::protobuf::RepeatedField<float>& column, int index) {
  const int begin = column.size() > 3 ? 3 * index : 0;
  return {double{column[begin]}, double{column[begin + 1]}, double{column[begin + 2]}};
}

double number_at(const google::protobuf::RepeatedField<float>& column, int index, double otherwise) {
  if (column.empty()) return otherwise;
  return double{column[column.size() > 1 ? index : 0]};
}

template <class T>
void shuffle(std::vector<T>& values) {
  SplitMix64 random(1);
  for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.below(static_cast<uint32_t>(i))]);
}

void add(const v1::QueryBlock& block, const Vec3d& offset, FamilyQueries& queries) {
  for (int i = 0; i < std::max(block.rays().origins_size(), block.rays().directions_size()) / 3; ++i)
    queries.rays.push_back({at(block.rays().origins(), i) + offset, at(block.rays().directions(), i),
                            number_at(block.rays().t_max(), i, kUnlimited)});
  for (int i = 0; i < block.balls().centers_size() / 3; ++i)
    queries.balls.push_back({at(block.balls().centers(), i) + offset, number_at(block.balls().radii(), i, 0)});
  for (int i = 0; i < block.boxes().centers_size() / 3; ++i) {
    const auto& rotations = block.boxes().rotations();
    const int begin = rotations.size() > 4 ? 4 * i : 0;
    const Quaternion rotation = rotations.empty() ? Quaternion()
                                                  : Quaternion{rotations[begin], rotations[begin + 1],
                                                               rotations[begin + 2], rotations[begin + 3]};
    queries.boxes.push_back(
        {at(block.boxes().centers(), i) + offset, at(block.boxes().half_extents(), i), rotation_of(rotation)});
  }
  for (int i = 0; i < block.nearest().points_size() / 3; ++i)
    queries.nearest.push_back({at(block.nearest().points(), i) + offset,
                               number_at(block.nearest().max_distances(), i, kUnlimited),
                               std::max(block.nearest().k(), 1u)});
}

}  // namespace

absl::StatusOr<std::vector<PlacedShape>> shapes_of(const ObjectBatches& objects, const Vec3d& frame) {
  std::vector<PlacedShape> shapes;
  const auto add_shape = [&shapes](const Shape& shape) { shapes.push_back({shapes.size() + 1, shape}); };
  for (const v1::UpdateBatch& batch : objects.batches()) {
    v1::DumpSceneResponse message;
    *message.mutable_objects() = batch.inserts();
    RETURN_IF_ERROR(for_each_thing(message, [&](const SceneThing& thing) {
      if (shapes.size() >= kMaxTimedShapes) return too_many("objects", kMaxTimedShapes);
      const Vec3d position = Vec3d{thing.at[0], thing.at[1], thing.at[2]} - frame;
      const Quaternion rotation = quaternion_of(thing.rotation);
      if (thing.compound == nullptr) {
        add_shape({kind_of_thing(thing.kind), position, rotation, vector_of(thing.size), thing.radius});
        return absl::OkStatus();
      }
      const Rotation matrix = rotation_of(rotation);
      for_each_part(*thing.compound, [&](const PartRow& part) {
        add_shape({kind_of_part(part.shape), position + matrix.to_world(to_double(vector_of(part.at))),
                   product(rotation, quaternion_of(part.rotation)), vector_of(part.size), part.radius});
      });
      return absl::OkStatus();
    }));
  }
  return shapes;
}

absl::StatusOr<std::vector<Triangle>> triangles_of(const client::Client& client, const ObjectBatches& objects,
                                                   const Vec3d& frame, ProgressWriter& progress) {
  std::map<std::string, client::DownloadedMesh> meshes;
  std::vector<Triangle> triangles;
  for (const v1::Placement& run : objects.instances()) {
    if (!meshes.contains(run.mesh())) {
      progress.begin({.action = "downloading", .subject = run.mesh(), .unit = "bytes"});
      ASSIGN_OR_RETURN(meshes[run.mesh()],
                       client.download_mesh(run.mesh(), [&progress](uint64_t received, uint64_t total) {
                         progress.update(received, total);
                       }));
    }
    const client::DownloadedMesh& mesh = meshes[run.mesh()];
    v1::DumpSceneResponse message;
    *message.add_instances() = run;
    RETURN_IF_ERROR(for_each_thing(message, [&](const SceneThing& thing) {
      if (triangles.size() + mesh.indices.size() / 3 > kMaxTimedTriangles)
        return too_many("triangles", kMaxTimedTriangles);
      const Transform transform = make_transform(Vec3d{thing.at[0], thing.at[1], thing.at[2]} - frame,
                                                 quaternion_of(thing.rotation), thing.scale);
      const auto corner = [&](size_t index) {
        const float* const v = &mesh.vertices[3 * size_t{mesh.indices[index]}];
        const Vec3d world = transform.point_to_world({double{v[0]}, double{v[1]}, double{v[2]}});
        return Vec3f{static_cast<float>(world.x), static_cast<float>(world.y), static_cast<float>(world.z)};
      };
      for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
        triangles.push_back({corner(i), corner(i + 1), corner(i + 2), static_cast<uint32_t>(triangles.size())});
      return absl::OkStatus();
    }));
  }
  return triangles;
}

FamilyQueries family_queries(const QuerySet& queries, const Vec3d& frame) {
  FamilyQueries all;
  for (const QuerySet::Entry& entry : queries.batches())
    for (const v1::QueryBlock& block : entry.batch.blocks())
      add(block, Vec3d{block.frame().x(), block.frame().y(), block.frame().z()} - frame, all);
  shuffle(all.rays);
  shuffle(all.balls);
  shuffle(all.boxes);
  shuffle(all.nearest);
  return all;
}

}  // namespace locus::cli
