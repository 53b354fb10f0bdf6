// Comparison of a scene with compounds and a scene in which every part is an object of its own: the rows about parts
// must be equal, bit for bit. Used by the property tests and by the tests of planted bugs.
#ifndef LOCUS_TESTS_SUPPORT_PART_SCENES_H_
#define LOCUS_TESTS_SUPPORT_PART_SCENES_H_

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/base/limits.h"
#include "tests/support/oracle_scene.h"
#include "tests/support/random_query.h"

namespace locus::test {

// World in which the parts of compounds are objects, and the ids of both worlds. The order of the new ids is that of
// the old ids and, for one old id, that of the parts.
class PartWorld {
 public:
  explicit PartWorld(const QueryWorld& world) : world_(world) {
    for (const PlacedMesh& placed : world.instances) ids_.push_back(placed.id);
    for (const Object& object : world.objects) ids_.push_back(object.id);
    std::sort(ids_.begin(), ids_.end());
    for (PlacedMesh& placed : world_.instances) placed.id = id_of(placed.id, 0);
    world_.objects.clear();
    compounds_.resize(ids_.size());
    for (const Object& object : world.objects) add(object);
  }

  const QueryWorld& world() const { return world_; }
  // Returns whether all parts lie in the world, so that they can be objects.
  bool is_valid() const {
    return std::all_of(world_.objects.begin(), world_.objects.end(), [](const Object& object) {
      return max_component(abs(object.shape.position)) <= limits::kMaxCoordinate;
    });
  }
  // Replaces the ids of `result` by the old ids, and names the parts of compounds.
  void translate(BlockResult& result) const {
    for (size_t row = 0; row < result.ids.size(); ++row) {
      const uint64_t id = result.ids[row];
      if (id == 0) continue;
      const size_t rank = id / limits::kMaxParts - 1;
      result.ids[row] = ids_[rank];
      if (compounds_[rank]) result.triangles[row] = static_cast<uint32_t>(id % limits::kMaxParts);
    }
  }

 private:
  uint64_t id_of(Id id, uint64_t part) const {
    const auto rank = std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin();
    return (static_cast<uint64_t>(rank) + 1) * limits::kMaxParts + part;
  }
  void add(const Object& object) {
    Object one = object;
    one.id = id_of(object.id, 0);
    one.compound = nullptr;
    if (object.compound == nullptr) return world_.objects.push_back(one);
    compounds_[one.id / limits::kMaxParts - 1] = true;
    const Shape& pose = object.shape;
    for (const Part& part : object.compound->parts()) {
      one.layers = object.layers & part.layers;
      one.shape = {part.kind, pose.position + rotation_of(pose.rotation).to_world(to_double(part.position)),
                   OracleScene::after(pose.rotation, part.rotation), part.size, part.radius};
      world_.objects.push_back(one);
      ++one.id;
    }
  }

  QueryWorld world_;
  std::vector<Id> ids_;  // of the world with compounds, ascending
  std::vector<bool> compounds_;
};

// Prepares a block for both worlds: removes ids from its columns, and asks for a row for each part. Returns false if
// rows of the block are about whole objects.
inline bool asks_for_parts(OwnedBlock& block) {
  QueryBlock& settings = block.settings;
  for (auto* column : {&block.ignore_ids, &block.self_ids, &block.anchor_ids, &block.after_ids}) column->clear();
  block.after_ts.clear();
  block.after_triangles.clear();
  settings.after_id = kNoId;
  ColumnSet columns;
  for (const Column column : {Column::kT, Column::kId, Column::kTriangle, Column::kNormal, Column::kPoint,
                              Column::kGroup, Column::kTag, Column::kLayers})
    if (served_columns(settings).has(column)) columns.add(column);
  settings.columns = columns;
  const auto set_detail = [](auto& kind) { kind.detail = StaticDetail::kTrianglesSorted; };
  if (auto* const balls = std::get_if<BallColumns>(&settings.kind)) set_detail(*balls);
  if (auto* const boxes = std::get_if<BoxColumns>(&settings.kind)) set_detail(*boxes);
  if (auto* const capsules = std::get_if<CapsuleColumns>(&settings.kind)) set_detail(*capsules);
  if (auto* const frustums = std::get_if<FrustumColumns>(&settings.kind)) set_detail(*frustums);
  if (auto* const nearest = std::get_if<NearestColumns>(&settings.kind)) set_detail(*nearest);
  return !std::holds_alternative<LookupColumns>(settings.kind) && !std::holds_alternative<PairColumns>(settings.kind) &&
         !std::holds_alternative<ContainsColumns>(settings.kind);
}

// Returns the first difference between the answers about `scene` and those about the scene of its parts; empty if there
// is none. Every block is compared exactly and by bounds.
inline std::string part_difference(const QueryScene& scene) {
  const PartWorld parts(scene.world);
  if (!parts.is_valid()) return "";
  std::vector<OwnedBlock> blocks;
  for (OwnedBlock block : scene.blocks) {
    if (!asks_for_parts(block)) continue;
    for (const Precision precision : {Precision::kExact, Precision::kConservative}) {
      block.settings.precision = precision;
      blocks.push_back(block);
    }
  }
  const QueryBatch batch = batch_of(blocks);
  if (const absl::Status status = check_batch(batch); !status.ok()) return status.ToString();
  const SnapshotPtr with_compounds = snapshot_of(scene.world), with_parts = snapshot_of(parts.world());
  const auto got = run_batch(*with_compounds, batch, {});
  auto expected = run_batch(*with_parts, batch, {});
  if (!got.ok() || !expected.ok()) return "a batch was refused";
  for (size_t i = 0; i < batch.blocks.size(); ++i) {
    parts.translate(expected->blocks[i]);
    if (std::string what = difference(got->blocks[i], expected->blocks[i]); !what.empty())
      return "block " + std::to_string(i) + " of kind " + std::to_string(batch.blocks[i].kind.index()) + ", " + what;
  }
  return "";
}

// Returns the first difference of part_difference() over random and adversarial scenes; empty if there is none.
inline std::string search_part_scenes(uint64_t count) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    Random random(seed);
    const QueryScene scene =
        query_scene(seed % 2 == 0 ? random_sketch(seed, random) : troublesome_sketch(seed / 2, random), random);
    if (scene.world.compounds.empty()) continue;
    if (std::string what = part_difference(scene); !what.empty()) return "seed " + std::to_string(seed) + ": " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PART_SCENES_H_
