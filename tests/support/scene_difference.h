// Comparison of the whole visible state of two scenes: for tests that restore one scene from the log of the other.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_DIFFERENCE_H_
#define LOCUS_TESTS_SUPPORT_SCENE_DIFFERENCE_H_

#include <algorithm>
#include <string>
#include <vector>

#include "core/index/queries/index_queries.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "tests/support/random.h"

namespace locus::test {

// Returns the first difference; empty if there is none. All functions in this file return a difference in this way.
inline std::string ack_difference(const UpdateAck& a, const UpdateAck& b) {
  if (a.epoch != b.epoch) return "epoch of the ack";
  if (a.revision != b.revision || a.tick != b.tick) return "revision or tick of the ack";
  if (a.applied != b.applied || a.refused != b.refused) return "counts of the ack";
  if (a.duplicate != b.duplicate) return "duplicate";
  const auto same = [](const ItemError& one, const ItemError& other) {
    return one.field == other.field && one.index == other.index && one.id == other.id && one.reason == other.reason &&
           one.message == other.message;
  };
  return std::equal(a.errors.begin(), a.errors.end(), b.errors.begin(), b.errors.end(), same) ? ""
                                                                                              : "errors of the ack";
}

inline std::string ack_difference(const absl::StatusOr<UpdateAck>& a, const absl::StatusOr<UpdateAck>& b) {
  if (a.status() != b.status()) return "status: " + a.status().ToString() + " and " + b.status().ToString();
  return a.ok() ? ack_difference(*a, *b) : "";
}

inline std::string writers_difference(const WriterTable& a, const WriterTable& b) {
  const std::vector<WriterTable::Writer> one = a.writers(), other = b.writers();
  if (one.size() != other.size()) return "number of writers";
  for (size_t i = 0; i < one.size(); ++i) {
    const std::string which = " of writer " + std::to_string(one[i].number);
    if (one[i].number != other[i].number || one[i].batch != other[i].batch) return "last batch" + which;
    if (one[i].heard != other[i].heard) return "order" + which;
    if (const std::string what = ack_difference(one[i].ack, other[i].ack); !what.empty()) return what + which;
  }
  return "";
}

inline std::string statics_difference(const StaticSet& a, const StaticSet& b) {
  if (a.size() != b.size()) return "number of instances";
  for (const Instance& one : a.tree().values()) {
    const Instance* other = b.find(one.id);
    const std::string which = "instance " + std::to_string(one.id);
    if (other == nullptr) return which;
    if (one.mesh->sha256() != other->mesh->sha256()) return which + "'s mesh";
    if (one.group != other->group || one.tag != other->tag || one.layers != other->layers) return which + "'s labels";
    const Transform &here = one.transform, &there = other->transform;
    if (here.translation != there.translation || !(here.quaternion == there.quaternion) || here.scale != there.scale ||
        !(here.rotation == there.rotation))
      return which + "'s place";
  }
  return "";
}

inline std::vector<Object> sorted_objects(const ObjectSet& set) {
  std::vector<Object> objects;
  set.for_each([&](const Object& object) { objects.push_back(object); });
  std::sort(objects.begin(), objects.end(), [](const Object& a, const Object& b) { return a.id < b.id; });
  return objects;
}

// Compares two sets of objects: the sorted objects of both sets, the lookup of each id, and the objects in a ball.
inline std::string objects_difference(const ObjectSet& a, const ObjectSet& b, Random& random) {
  if (a.size() != b.size()) return "number of objects";
  const std::vector<Object> objects = sorted_objects(a);
  if (objects != sorted_objects(b)) return "objects of the grid";
  for (const Object& object : objects)
    if (b.find(object.id) != object) return "object " + std::to_string(object.id);
  const Balld ball{random.whole_vector(3) * 8, random.between(0, 20)};
  const auto found_in = [&ball](const ObjectSet& set) {
    std::vector<Object> found;
    ball_overlap(set, ball, found);
    std::sort(found.begin(), found.end(), [](const Object& one, const Object& other) { return one.id < other.id; });
    return found;
  };
  return found_in(a) == found_in(b) ? "" : "objects that a ball finds";
}

// Compares the objects of both snapshots at one random time, possibly between ticks, that the history of both contains.
inline std::string past_difference(const SceneSnapshot& a, const SceneSnapshot& b, Random& random) {
  const uint64_t oldest = std::max(a.oldest_tick(), b.oldest_tick());
  if (oldest > a.tick) return "the past";
  const AsOf time{oldest + random.below(a.tick - oldest + 1), random.chance(0.5) ? random.float_between(0, 0.99) : 0};
  const std::optional<SceneAtTime> one = find_scene_at(a, time), other = find_scene_at(b, time);
  if (one.has_value() != other.has_value()) return "whether a moment is kept";
  if (!one) return "";
  const auto shapes = [](const SceneAtTime& moment) {
    std::vector<Object> objects;
    moment.objects().grid().for_each([&](const GridRef& value) {
      objects.push_back(object_of(value));
      objects.back().shape = moment.shape(value);
      return true;
    });
    std::sort(objects.begin(), objects.end(), [](const Object& x, const Object& y) { return x.id < y.id; });
    return objects;
  };
  return shapes(*one) == shapes(*other) ? "" : "objects at tick " + std::to_string(time.tick);
}

inline std::string snapshot_difference(const SceneSnapshot& a, const SceneSnapshot& b, Random& random) {
  if (a.epoch != b.epoch) return "epoch";
  if (a.revision != b.revision) return "revision " + std::to_string(a.revision) + " and " + std::to_string(b.revision);
  if (a.tick != b.tick) return "tick";
  if (a.winding != b.winding) return "winding";
  if (std::string what = statics_difference(*a.statics, *b.statics); !what.empty()) return what;
  if (std::string what = objects_difference(a.objects, b.objects, random); !what.empty()) return what;
  for (const Object& object : sorted_objects(a.objects))
    if (a.remaining_ticks(a.objects.find_ref(object.id).handle()) !=
        b.remaining_ticks(b.objects.find_ref(object.id).handle()))
      return "expiry of object " + std::to_string(object.id);
  return past_difference(a, b, random);
}

// Compares the leases and the ids of their objects.
inline std::string lease_difference(const FrozenScene& a, const FrozenScene& b) {
  if (a.leases.leases != b.leases.leases) return "leases";
  for (const Lease& lease : a.leases.leases) {
    const auto ids_in = [&lease](const FrozenScene& scene) {
      std::vector<Id> ids;
      scene.leases.objects.for_each(lease.writer, [&](uint32_t handle) {
        ids.push_back(scene.snapshot->objects.grid().at(handle).entry().id);
        return true;
      });
      std::sort(ids.begin(), ids.end());
      return ids;
    };
    if (ids_in(a) != ids_in(b)) return "objects of the lease of writer " + std::to_string(lease.writer);
  }
  return "";
}

inline std::string scene_difference(Scene& a, Scene& b, Random& random) {
  const FrozenScene one = a.freeze(), other = b.freeze();
  if (std::string what = snapshot_difference(*one.snapshot, *other.snapshot, random); !what.empty()) return what;
  if (one.has_past != other.has_past) return "whether there is a past";
  if (std::string what = lease_difference(one, other); !what.empty()) return what;
  return writers_difference(one.writers, other.writers);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_DIFFERENCE_H_
