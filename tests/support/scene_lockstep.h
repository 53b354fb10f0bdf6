// Applies random update batches and static changes to a scene and to its model, and compares all visible state. This
// state is acks and refusals, objects, the grid's content and answers, instances, and snapshots kept during the run.
// Used by the random tests, which expect no difference, and by the tests of planted bugs, which expect a difference.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_LOCKSTEP_H_
#define LOCUS_TESTS_SUPPORT_SCENE_LOCKSTEP_H_

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/index/queries/index_queries.h"
#include "core/scene/scene.h"
#include "tests/support/random_updates.h"
#include "tests/support/scene_model.h"

namespace locus::test {

inline std::shared_ptr<const StaticMesh> one_triangle_mesh() {
  absl::StatusOr<TriangleMesh> mesh = TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {});
  LOCUS_CHECK(mesh.ok());
  absl::StatusOr<std::shared_ptr<const StaticMesh>> built = StaticMesh::build("triangle", {}, *std::move(mesh));
  LOCUS_CHECK(built.ok());
  return *std::move(built);
}

class SceneLockstep {
 public:
  explicit SceneLockstep(uint64_t seed)
      : random_(seed),
        updates_(random_, kIds),
        mesh_(one_triangle_mesh()),
        scene_("lockstep", {}, 1, StaticSet::empty()) {}

  // Returns the first difference; empty if there is none.
  std::string run(int batches) {
    for (int batch = 0; batch < batches; ++batch) {
      std::string what = random_.chance(0.1) ? change_instances() : random_.chance(0.1) ? end_lease() : apply_batch();
      if (what.empty()) what = lease_difference();
      if (what.empty()) what = difference(*scene_.latest(), model_);
      if (!what.empty()) return "batch " + std::to_string(batch) + ": " + what;
      if (random_.chance(0.02)) kept_.emplace_back(scene_.latest(), model_);
    }
    for (const auto& [snapshot, model] : kept_) {
      const std::string what = difference(*snapshot, model);
      if (!what.empty()) return "snapshot " + std::to_string(snapshot->revision) + ": " + what;
    }
    return "";
  }

 private:
  static constexpr uint64_t kIds = 60;

  static std::string difference(const ItemError& actual, const ItemError& expected) {
    if (actual.field == expected.field && actual.index == expected.index && actual.id == expected.id &&
        actual.reason == expected.reason && actual.message == expected.message)
      return "";
    return "error " + actual.field + " " + std::to_string(actual.index) + " for " + expected.field + " " +
           std::to_string(expected.index);
  }

  static std::string difference(const UpdateAck& actual, const UpdateAck& expected) {
    if (actual.revision != expected.revision || actual.tick != expected.tick) return "revision or tick of the ack";
    if (actual.applied != expected.applied || actual.refused != expected.refused) return "counts of the ack";
    if (actual.duplicate != expected.duplicate) return "duplicate";
    if (actual.errors.size() != expected.errors.size()) return "number of errors";
    for (size_t i = 0; i < actual.errors.size(); ++i)
      if (std::string what = difference(actual.errors[i], expected.errors[i]); !what.empty()) return what;
    return "";
  }

  static std::string difference(const absl::StatusOr<UpdateAck>& actual, const SceneModel::Outcome& expected) {
    if (actual.status().code() != expected.code) return "status " + actual.status().ToString();
    if (actual.ok()) return difference(*actual, expected.ack);
    const Refusal refusal = refusal_of(actual.status()).value_or(Refusal{});
    ItemError error{refusal.field, refusal.index.value_or(0), expected.error.id, refusal.reason,
                    expected.error.message};
    return difference(error, expected.error);
  }

  // Compares the objects that the grid finds in a random ball with the objects of the model in this ball.
  std::string ball_difference(const SceneSnapshot& snapshot, const SceneModel& model) {
    const Balld ball{random_.whole_vector(3) * 8, random_.between(0, 20)};
    std::vector<Object> found;
    ball_overlap(snapshot.objects, ball, found);
    size_t expected = 0;
    for (const auto& [id, object] : model.objects()) expected += PrimitiveTraits<Object>::ball(object, ball);
    if (found.size() != expected) return "objects that a ball finds";
    for (const Object& object : found) {
      const auto known = model.objects().find(object.id);
      if (known == model.objects().end() || !(known->second == object)) return "an object that a ball finds";
    }
    return "";
  }

  static SceneModel::Placed state_of(const Instance& instance) {
    SceneModel::Placed placed;
    placed.pose.position = instance.transform.translation;
    placed.pose.rotation = instance.transform.quaternion;
    placed.scale = instance.transform.scale;
    placed.layers = instance.layers;
    placed.group = instance.group;
    placed.tag = instance.tag;
    return placed;
  }

  // Visitor of the tree over instances that counts the instances whose bounds overlap a box.
  struct BoxCount {
    Aabbd box;
    size_t found = 0;

    Aabbd bounds() const { return box; }
    bool overlaps(const Aabbd& other) const { return locus::overlaps(box, other); }
    bool visit(const Instance& instance) {
      found += overlaps(instance.bounds);
      return true;
    }
  };

  // Compares the number of instances that the tree finds in a random box with that of the model.
  std::string box_difference(const SceneSnapshot& snapshot, const SceneModel& model) {
    const Vec3d center = random_.whole_vector(3) * 8;
    BoxCount count{grown(Aabbd{center, center}, random_.between(0, 20))};
    Work work;
    snapshot.statics->tree().visit_region(count, work);
    size_t expected = 0;
    for (const auto& [id, placed] : model.instances())
      expected += overlaps(
          count.box,
          bounds_to_world(make_transform(placed.pose.position, placed.pose.rotation, placed.scale), mesh_->bounds()));
    return count.found == expected ? "" : "number of instances in a box";
  }

  std::string difference(const SceneSnapshot& snapshot, const SceneModel& model) {
    std::vector<Object> in_grid;
    snapshot.objects.for_each([&](const Object& object) { in_grid.push_back(object); });
    std::sort(in_grid.begin(), in_grid.end(), [](const Object& a, const Object& b) { return a.id < b.id; });
    if (snapshot.objects.size() != model.objects().size()) return "number of objects";
    if (in_grid.size() != model.objects().size()) return "number of objects in the grid";
    size_t at = 0;
    for (const auto& [id, object] : model.objects()) {
      const std::optional<Object> known = snapshot.objects.find(id);
      if (!known || !(*known == object)) return "object " + std::to_string(id);
      if (!(in_grid[at++] == object)) return "object " + std::to_string(id) + " in the grid";
      const uint64_t remaining = snapshot.remaining_ticks(snapshot.objects.find_ref(id).handle());
      if (remaining != model.ends().at(id).remaining) return "expiry of object " + std::to_string(id);
    }
    if (snapshot.statics->size() != model.instances().size()) return "number of instances";
    for (const auto& [id, placed] : model.instances()) {
      const Instance* const known = snapshot.statics->find(id);
      if (known == nullptr || !(state_of(*known) == placed)) return "instance " + std::to_string(id);
    }
    if (std::string what = box_difference(snapshot, model); !what.empty()) return what;
    return ball_difference(snapshot, model);
  }

  // Compares the leases and their objects.
  std::string lease_difference() {
    const FrozenScene frozen = scene_.freeze();
    if (frozen.leases.leases != *scene_.leases()) return "list of leases";
    std::map<uint64_t, uint32_t> leases;
    std::map<Id, uint64_t> owners;
    for (const Lease& lease : frozen.leases.leases) {
      leases[lease.writer] = lease.lease_ms;
      frozen.leases.objects.for_each(lease.writer, [&](uint32_t handle) {
        owners[frozen.snapshot->objects.grid().at(handle).entry().id] = lease.writer;
        return true;
      });
    }
    if (leases != model_.leases()) return "leases";
    for (const auto& [id, end] : model_.ends())
      if (end.owner != (owners.contains(id) ? owners.at(id) : 0)) return "owner of object " + std::to_string(id);
    return "";
  }

  std::string end_lease() {
    const uint64_t writer = updates_.draw_writer();
    const absl::StatusOr<std::optional<uint64_t>> ended = scene_.end_lease(writer, [] { return true; });
    return ended.ok() && ended->has_value() == model_.end_lease(writer) ? "" : "whether the lease of a writer ends";
  }

  std::string apply_batch() {
    Columns columns;
    const UpdateBatch batch = updates_.draw(columns, 12);
    return difference(scene_.apply(batch), model_.apply(batch));
  }

  std::string change_instances() {
    const uint64_t removed = random_.chance(0.7) ? 0 : random_.below(kIds);
    const uint64_t placed = random_.below(kIds);
    const double origin[3] = {};
    StaticChange change;
    if (removed != 0) change.remove_ids = {&removed, 1};
    change.place.push_back({mesh_, {&placed, 1}, origin, {}, {}, {}, {}, {}});
    return scene_.change_instances(change).ok() == model_.change_instances(removed, placed) ? "" : "static change";
  }

  Random random_;
  RandomUpdates updates_;
  std::shared_ptr<const StaticMesh> mesh_;
  Scene scene_;
  SceneModel model_;
  std::vector<std::pair<SnapshotPtr, SceneModel>> kept_;
};

// Returns the first difference over `count` scenes of `batches` batches each; empty if there is none.
inline std::string search_scene_lockstep(uint64_t count, int batches) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    const std::string what = SceneLockstep(seed).run(batches);
    if (!what.empty()) return "seed " + std::to_string(seed) + ", " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_LOCKSTEP_H_
