// The content of a scene as plain lists, and the functions with which the oracles of all query kinds select, count and
// write rows.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_SCENE_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_SCENE_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "core/query/kinds/placed_triangle.h"
#include "tests/support/run_batch.h"

namespace locus::test {

class OracleScene {
 public:
  explicit OracleScene(const SceneSnapshot& snapshot) : clockwise_(snapshot.winding == Winding::kClockwise) {
    for (const Instance& instance : snapshot.statics->tree().values()) {
      instances_.push_back(&instance);
      std::vector<uint32_t>& storage = storage_[instance.mesh.get()];
      if (!storage.empty()) continue;
      storage.resize(instance.mesh->tree().size());
      uint32_t position = 0;
      instance.mesh->tree().for_each([&](const Triangle& triangle) { storage[triangle.number] = position++; });
    }
    std::vector<Object> objects;
    snapshot.objects.for_each([&objects](const Object& object) { objects.push_back(object); });
    add_objects(objects);
  }
  // Makes an oracle that uses `objects`, the objects of another time, instead of the objects of the snapshot.
  OracleScene(const SceneSnapshot& snapshot, const std::vector<Object>& objects) : OracleScene(snapshot) {
    objects_.clear();
    wholes_.clear();
    add_objects(objects);
  }

  // Object without parts, or one part of a compound as an object of its own, with the id of the compound.
  struct OracleObject : Object {
    uint32_t part = kNoTriangle;  // number of the part, or kNoTriangle for an object without parts
    Shape whole;                  // shape of the whole object, which gives the pose
  };

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  struct Row {
    float t = 0;
    Id id = 0;
    uint32_t triangle = kNoTriangle;
    uint32_t storage = 0;
    const OracleObject* object = nullptr;
    const Instance* instance = nullptr;
    float u = 0, v = 0;
    Vec3d normal;  // surface normal; nearest queries and cells: vector to the nearest point
    Vec3d place;   // sweeps only: point of contact, relative to the start
  };
  using Rows = std::vector<Row>;

  // Adds objects, and the parts of compounds: a part has the layers that both it and its compound have, the rotation of
  // the compound after its own, and its position in the axes of the compound.
  void add_objects(const std::vector<Object>& objects) {
    for (const Object& object : objects) {
      wholes_.push_back({object, kNoTriangle, object.shape});
      if (object.compound == nullptr) {
        objects_.push_back(wholes_.back());
        continue;
      }
      for (uint32_t number = 0; number < object.compound->parts().size(); ++number) {
        const Part& part = object.compound->parts()[number];
        OracleObject one = {object, number, object.shape};
        one.layers = object.layers & part.layers;
        one.compound = nullptr;
        one.shape.kind = part.kind;
        one.shape.size = part.size;
        one.shape.radius = part.radius;
        one.shape.position =
            object.shape.position + rotation_of(object.shape.rotation).to_world(to_double(part.position));
        one.shape.rotation = after(object.shape.rotation, part.rotation);
        objects_.push_back(one);
      }
    }
  }
  // Returns the rotation by `first`, then by `second`.
  static Quaternion after(const Quaternion& second, const Quaternion& first) {
    const Vec3d a = {second.x, second.y, second.z}, b = {first.x, first.y, first.z};
    const double aw = second.w, bw = first.w;
    const double x = aw * b.x + a.x * bw + a.y * b.z - a.z * b.y, y = aw * b.y - a.x * b.z + a.y * bw + a.z * b.x,
                 z = aw * b.z + a.x * b.y - a.y * b.x + a.z * bw, w = aw * bw - a.x * b.x - a.y * b.y - a.z * b.z;
    const double n = std::sqrt(x * x + y * y + z * z + w * w);
    return {static_cast<float>(x / n), static_cast<float>(y / n), static_cast<float>(z / n), static_cast<float>(w / n)};
  }
  const OracleObject* whole_of(Id id) const {
    for (const OracleObject& object : wholes_)
      if (object.id == id) return &object;
    return nullptr;
  }
  // Keeps, of the rows of each compound, only the nearest; of equally near rows, that of the lowest part.
  static void keep_nearest_parts(Rows& rows) {
    const auto is_beaten = [rows](const Row& row) {
      return row.object != nullptr && std::any_of(rows.begin(), rows.end(), [&row](const Row& other) {
               return other.id == row.id && std::tie(other.t, other.triangle) < std::tie(row.t, row.triangle);
             });
    };
    std::erase_if(rows, is_beaten);
  }

  static float entry_of(double near) {
    return near <= 0 ? 0.0f
                     : static_cast<float>(std::min(near, static_cast<double>(std::numeric_limits<float>::max())));
  }

  static std::optional<float> entry_of(const SlabRay<double>& slabs, const Aabbd& bounds) {
    const Interval<double> own = slabs.interval(bounds);
    if (own.near <= own.far && own.far >= 0) return entry_of(own.near);
    return std::nullopt;
  }

  // Returns the position of the anchor of query `i`; nullopt if the scene does not contain the anchor.
  std::optional<Vec3d> anchor(const QueryBlock& block, size_t i) const {
    const uint64_t id = entry_for(block.anchor_ids, i, uint64_t{0});
    for (const OracleObject& object : wholes_)
      if (object.id == id) return object.shape.position;
    for (const Instance* instance : instances_)
      if (instance->id == id) return instance->transform.translation;
    return std::nullopt;
  }
  // Returns the columns whose positions are relative to anchors, each with the number of points that it has per query.
  static std::vector<std::pair<absl::Span<const float>, size_t>> anchored_columns(const QueryBlock& block) {
    if (const auto* rays = std::get_if<RayColumns>(&block.kind)) return {{rays->origins, 1}};
    if (const auto* balls = std::get_if<BallColumns>(&block.kind)) return {{balls->centers, 1}};
    if (const auto* boxes = std::get_if<BoxColumns>(&block.kind)) return {{boxes->centers, 1}};
    if (const auto* capsules = std::get_if<CapsuleColumns>(&block.kind))
      return {{capsules->starts, 1}, {capsules->ends, 1}};
    if (const auto* sweeps = std::get_if<SweepColumns>(&block.kind)) return {{sweeps->starts, 1}, {sweeps->ends, 1}};
    if (const auto* nearest = std::get_if<NearestColumns>(&block.kind)) return {{nearest->points, 1}};
    if (const auto* contains = std::get_if<ContainsColumns>(&block.kind)) return {{contains->points, 1}};
    if (const auto* cells = std::get_if<CellColumns>(&block.kind)) return {{cells->points, 1}};
    if (const auto* sight = std::get_if<SightColumns>(&block.kind)) return {{sight->viewers, sight->eyes_per_viewer()}};
    return {};
  }
  // Returns whether query `i` has no answer because its anchor is unknown, or because one of its positions is outside
  // the world.
  bool is_unanchored(const QueryBlock& block, size_t i) const {
    if (block.anchor_ids.empty()) return false;
    const std::optional<Vec3d> from = anchor(block, i);
    if (!from) return true;
    for (const auto& [column, points] : anchored_columns(block)) {
      const size_t first = column.size() == 3 * points ? 0 : 3 * points * i;
      for (size_t k = 0; k < 3 * points; ++k)
        if (std::abs((*from)[static_cast<int>(k % 3)] + double{column[first + k]}) > 1e9) return true;
    }
    return false;
  }
  // Returns the point to which the positions of query `i` are relative.
  Vec3d origin(const QueryBlock& block, size_t i) const {
    return block.anchor_ids.empty() ? block.frame : anchor(block, i).value_or(Vec3d{});
  }
  // Returns the point of query `i` in a column that has one point for each query, or one point for all queries.
  Vec3d point(const QueryBlock& block, absl::Span<const float> column, size_t i) const {
    const float* const offset = &column[column.size() == 3 ? 0 : 3 * i];
    return origin(block, i) + Vec3d{offset[0], offset[1], offset[2]};
  }
  template <class T>
  static T entry_for(absl::Span<const T> column, size_t i, T fallback) {
    return column.empty() ? fallback : column[column.size() == 1 ? 0 : i];
  }

  template <class Item>
  bool wanted(const QueryBlock& block, size_t i, const Item& item) const {
    if (is_unanchored(block, i) || entry_for(block.anchor_ids, i, uint64_t{0}) == item.id) return false;
    const uint32_t mask = entry_for(block.masks, i, 0xFFFFFFFFu);
    const uint64_t group = entry_for(block.ignore_groups, i, uint64_t{0});
    for (const uint64_t id : block.ignore_ids)
      if (id == item.id) return false;
    if (entry_for(block.self_ids, i, uint64_t{0}) == item.id || !has_wanted_tag(block, i, item.tag)) return false;
    if (!is_in_wanted_group(block, i, item.group)) return false;
    return (item.layers & mask) > 0 && (group == 0 || group != item.group);
  }
  // Returns whether the tag has the bits that query `i` asks for.
  static bool has_wanted_tag(const QueryBlock& block, size_t i, uint64_t tag) {
    const uint64_t wanted = entry_for(block.tags, i, uint64_t{0}), mask = entry_for(block.tag_masks, i, ~uint64_t{0});
    for (int bit = 0; bit < 64 && !block.tags.empty(); ++bit)
      if ((mask >> bit & 1) != 0 && (tag >> bit & 1) != (wanted >> bit & 1)) return false;
    return true;
  }
  // Returns whether query `i` is not restricted to groups, or is restricted to some that include `group`.
  static bool is_in_wanted_group(const QueryBlock& block, size_t i, uint64_t group) {
    const size_t each = block.only_groups_each == 0 ? 1 : block.only_groups_each;
    const size_t first = block.only_groups.size() == each ? 0 : i * each;
    bool is_restricted = false;
    for (size_t k = 0; k < each && !block.only_groups.empty(); ++k) {
      const uint64_t wanted = block.only_groups[first + k];
      if (wanted != 0 && wanted == group) return true;
      is_restricted = is_restricted || wanted != 0;
    }
    return !is_restricted;
  }

  static void count(const QueryBlock& block, Rows& rows, size_t i, BlockResult& result) {
    const size_t most = block.max_results == 0 ? 1024 : block.max_results;
    if (rows.size() > most) {
      rows.resize(most);
      result.truncated.push_back(static_cast<uint32_t>(i));
    }
    result.counts.push_back(static_cast<uint32_t>(rows.size()));
  }

  struct Defaults {
    ColumnSet operator()(const RayColumns&) const { return {Column::kT, Column::kId, Column::kTriangle}; }
    ColumnSet operator()(const SweepColumns&) const { return {Column::kT, Column::kId, Column::kTriangle}; }
    ColumnSet operator()(const BallColumns& balls) const { return of(balls.detail); }
    ColumnSet operator()(const BoxColumns& boxes) const { return of(boxes.detail); }
    ColumnSet operator()(const CapsuleColumns& capsules) const { return of(capsules.detail); }
    ColumnSet operator()(const FrustumColumns& frustums) const { return of(frustums.detail); }
    ColumnSet operator()(const SightColumns&) const { return {}; }
    ColumnSet operator()(const ContainsColumns&) const { return {Column::kId}; }
    ColumnSet operator()(const PairColumns& pairs) const {
      return pairs.count == 0 ? ColumnSet{Column::kId, Column::kOther}
                              : ColumnSet{Column::kT, Column::kId, Column::kOther};
    }
    ColumnSet operator()(const CellColumns&) const {
      return {Column::kT, Column::kId, Column::kTriangle, Column::kNormal};
    }
    ColumnSet operator()(const LookupColumns&) const { return {Column::kId, Column::kPose}; }
    ColumnSet operator()(const NearestColumns&) const { return {Column::kT, Column::kId, Column::kTriangle}; }
    static ColumnSet of(StaticDetail detail) {
      return detail == StaticDetail::kInstances ? ColumnSet{Column::kId} : ColumnSet{Column::kId, Column::kTriangle};
    }
  };
  static ColumnSet columns_of(const QueryBlock& block) {
    return block.columns.empty() ? std::visit(Defaults(), block.kind) : block.columns;
  }

  template <class Item>
  static void write_labels(const Item& item, ColumnSet columns, BlockResult& result) {
    if (columns.has(Column::kGroup)) result.groups.push_back(item.group);
    if (columns.has(Column::kTag)) result.tags.push_back(item.tag);
    if (columns.has(Column::kLayers)) result.layers.push_back(item.layers);
  }

  static void write(const Row& row, const QueryBlock& block, BlockResult& result) {
    const ColumnSet columns = columns_of(block);
    if (columns.has(Column::kT)) result.t.push_back(row.t);
    if (columns.has(Column::kId)) result.ids.push_back(row.id);
    if (columns.has(Column::kTriangle)) result.triangles.push_back(row.triangle);
    Vec3d position;
    Quaternion rotation{0, 0, 0, 0};
    if (row.object != nullptr) {
      write_labels(*row.object, columns, result);
      position = row.object->whole.position;
      rotation = row.object->whole.rotation;
    } else if (row.instance != nullptr) {
      write_labels(*row.instance, columns, result);
      position = row.instance->transform.translation;
      rotation = row.instance->transform.quaternion;
    } else {
      Object nothing;
      nothing.layers = 0;
      write_labels(nothing, columns, result);
    }
    if (!columns.has(Column::kPose)) return;
    result.positions.insert(result.positions.end(), {position.x, position.y, position.z});
    result.rotations.insert(result.rotations.end(), {rotation.x, rotation.y, rotation.z, rotation.w});
  }

  // Drops the rows that are not behind the page position of query `i`.
  static void keep_behind(const AfterColumns& after, size_t i, Rows& rows) {
    if (after.ts.empty()) return;
    const float t = entry_for(after.ts, i, 0.0f);
    const uint64_t id = entry_for(after.ids, i, ~uint64_t{0});
    const uint32_t triangle = entry_for(after.triangles, i, kNoTriangle);
    std::erase_if(rows, [&](const Row& row) {
      return row.t < t || (row.t == t && (row.id < id || (row.id == id && row.triangle <= triangle)));
    });
  }

  static void write_vector(Vec3f v, std::vector<float>& column) { column.insert(column.end(), {v.x, v.y, v.z}); }

  const bool clockwise_;
  std::vector<const Instance*> instances_;
  std::vector<OracleObject> objects_;  // objects without parts, and the parts of compounds
  std::vector<OracleObject> wholes_;   // all objects
  std::map<const StaticMesh*, std::vector<uint32_t>> storage_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_SCENE_H_
