#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "server/convert/convert.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/scene_access.h"
#include "server/services/scene_calls.h"

namespace locus::server {
namespace {

// Maximum number of things (objects, parts of compounds, and instances) in a piece, and maximum size in bytes of a
// thing. The size includes the thing's entries in the columns, the protobuf tags and lengths of a new message Insert or
// Placement, and a mesh's name.
constexpr size_t kThingsPerPiece = 16384;
constexpr size_t kMaxBytesPerThing = 8 + 24 + 16 + 16 + 4 + 8 + 8 + 8 + 64 + limits::kMaxNameLength;
static_assert(kThingsPerPiece * kMaxBytesPerThing <= limits::kDefaultReplyBytes);

template <class Message>
void add_position(const Vec3d& position, Message* to) {
  to->Add(position.x);
  to->Add(position.y);
  to->Add(position.z);
}

template <class Message>
void add_rotation(const Quaternion& rotation, Message* to) {
  to->add_rotations(rotation.x);
  to->add_rotations(rotation.y);
  to->add_rotations(rotation.z);
  to->add_rotations(rotation.w);
}

template <class Thing, class Message>
void add_labels(const Thing& thing, Message* to) {
  to->add_layers(thing.layers);
  to->add_groups(thing.group);
  to->add_tags(thing.tag);
}

void add_size(const Vec3f& size, google::protobuf::RepeatedField<float>* to) {
  to->Add(size.x);
  to->Add(size.y);
  to->Add(size.z);
}

// Adds one part, to the last entry of parts if they have the same kind of shape.
void add_part(const Part& part, v1::Compound* to) {
  const auto kind_of = [](ShapeKind kind) {
    return kind == ShapeKind::kBall  ? v1::Parts::kBall
           : kind == ShapeKind::kBox ? v1::Parts::kBox
                                     : v1::Parts::kCapsule;
  };
  const int last = to->parts_size() - 1;
  v1::Parts* const entry =
      last >= 0 && to->parts(last).shape_case() == kind_of(part.kind) ? to->mutable_parts(last) : to->add_parts();
  add_size(part.position, entry->mutable_positions());
  add_rotation(part.rotation, entry);
  entry->add_layers(part.layers);
  if (part.kind == ShapeKind::kBall) {
    entry->mutable_ball()->add_radii(part.radius);
  } else if (part.kind == ShapeKind::kBox) {
    add_size(part.size, entry->mutable_box()->mutable_half_extents());
  } else {
    entry->mutable_capsule()->add_radii(part.radius);
    add_size(part.size, entry->mutable_capsule()->mutable_half_axes());
  }
}

// Adds the shape of an object, except a compound, which all objects of an entry share.
void add_shape(const Shape& shape, v1::Insert* to) {
  switch (shape.kind) {
    case ShapeKind::kCompound:
      return;
    case ShapeKind::kPoint:
      to->mutable_point();
      return;
    case ShapeKind::kBall:
      to->mutable_ball()->add_radii(shape.radius);
      return;
    case ShapeKind::kBox:
      add_size(shape.size, to->mutable_box()->mutable_half_extents());
      return;
    case ShapeKind::kCapsule:
      to->mutable_capsule()->add_radii(shape.radius);
      add_size(shape.size, to->mutable_capsule()->mutable_half_axes());
      return;
  }
}

// Function that writes a piece to the caller; returns false to end the dump.
using TakeDumpPiece = std::function<bool(const v1::DumpSceneResponse&)>;

// Builder of the pieces of a dump. Passes each piece to `take` when the piece is full. Consecutive objects with the
// same kind of shape of which all or none expire, compounds with the same parts of which all or none expire, or
// instances of the same mesh, share a run of columns.
class Dump {
 public:
  Dump(const SceneSnapshot& snapshot, const TakeDumpPiece& take) : snapshot_(snapshot), take_(take) { start_piece(); }

  // `expire_ticks` is the number of ticks until the object expires; 0: it does not expire.
  void add(const Object& object, uint64_t expire_ticks) {
    if (!make_room(1 + (object.compound == nullptr ? 0 : object.compound->parts().size()))) return;
    const bool expires = expire_ticks != 0;
    if (piece_.objects().empty() || object.shape.kind != last_kind_ || object.compound != last_compound_ ||
        expires != last_expires_) {
      v1::Insert* const added = piece_.add_objects();
      if (object.compound != nullptr)
        for (const Part& part : object.compound->parts()) add_part(part, added->mutable_compound());
    } else if (object.compound != nullptr) {
      things_ -= object.compound->parts().size();  // the run has the parts already
    }
    last_kind_ = object.shape.kind;
    last_compound_ = object.compound;
    last_expires_ = expires;
    v1::Insert* run = piece_.mutable_objects(piece_.objects_size() - 1);
    run->add_ids(object.id);
    add_position(object.shape.position, run->mutable_positions_f64());
    add_rotation(object.shape.rotation, run);
    add_shape(object.shape, run);
    add_labels(object, run);
    if (expires) run->add_expire_ticks(expire_ticks);
  }

  void add(const Instance& instance) {
    if (!make_room(1)) return;
    if (piece_.instances().empty() || instance.mesh.get() != last_mesh_)
      piece_.add_instances()->set_mesh(instance.mesh->name());
    last_mesh_ = instance.mesh.get();
    v1::Placement* run = piece_.mutable_instances(piece_.instances_size() - 1);
    run->add_ids(instance.id);
    add_position(instance.transform.translation, run->mutable_translations());
    add_rotation(instance.transform.quaternion, run);
    run->add_scales(instance.transform.scale);
    add_labels(instance, run);
  }

  bool finish() {
    taken_ = taken_ && (things_ == 0 && pieces_ > 0 ? true : take_(piece_));
    return taken_;
  }

 private:
  // Counts more things of the piece. If they do not fit, first passes the piece to `take` and begins a new piece.
  // Returns false once `take` has ended the dump.
  bool make_room(size_t things) {
    if (taken_ && things_ + things > kThingsPerPiece) {
      taken_ = take_(piece_);
      ++pieces_;
      start_piece();
    }
    things_ += things;
    return taken_;
  }

  void start_piece() {
    piece_.Clear();
    piece_.set_epoch(snapshot_.epoch);
    piece_.set_revision(snapshot_.revision);
    things_ = 0;
  }

  const SceneSnapshot& snapshot_;
  const TakeDumpPiece& take_;
  v1::DumpSceneResponse piece_;
  size_t things_ = 0;
  size_t pieces_ = 0;
  bool taken_ = true;
  ShapeKind last_kind_ = ShapeKind::kPoint;
  bool last_expires_ = false;
  const Compound* last_compound_ = nullptr;
  const StaticMesh* last_mesh_ = nullptr;
};

// All objects and instances of a snapshot, in ascending order of ids.
struct DumpOrder {
  std::vector<GridRef> objects;
  std::vector<const Instance*> instances;
};

DumpOrder order_of(const SceneSnapshot& snapshot) {
  DumpOrder order;
  std::vector<GridRef>& objects = order.objects;
  std::vector<const Instance*>& instances = order.instances;
  objects.reserve(snapshot.objects.size());
  snapshot.objects.grid().for_each([&objects](const GridRef& object) {
    objects.push_back(object);
    return true;
  });
  std::sort(objects.begin(), objects.end(),
            [](const GridRef& a, const GridRef& b) { return a.entry().id < b.entry().id; });
  instances.reserve(snapshot.statics->size());
  for (const Instance& instance : snapshot.statics->tree().values()) instances.push_back(&instance);
  std::sort(instances.begin(), instances.end(), [](const Instance* a, const Instance* b) { return a->id < b->id; });
  return order;
}

// Sends objects, then instances, in one or more pieces. Returns false if `take` ended the dump.
bool dump_snapshot(const SceneSnapshot& snapshot, const DumpOrder& order, const TakeDumpPiece& take) {
  Dump dump(snapshot, take);
  for (const GridRef& object : order.objects) dump.add(object_of(object), snapshot.remaining_ticks(object.handle()));
  for (const Instance* instance : order.instances) dump.add(*instance);
  return dump.finish();
}

// Returns the maximum memory in bytes that a dump of the snapshot needs at any time, for the sorted lists of its
// objects and instances and for one piece. The piece exists as a message, whose columns double as they grow, and as
// bytes.
uint64_t dump_cost(const SceneSnapshot& snapshot) {
  const uint64_t things = snapshot.objects.size() + snapshot.statics->size();
  const uint64_t parts = snapshot.objects.compounds() == nullptr ? 0 : snapshot.objects.size() * limits::kMaxParts;
  return things * sizeof(GridRef) + 3 * std::min<uint64_t>(things + parts, kThingsPerPiece) * kMaxBytesPerThing;
}

}  // namespace

absl::Status dump_scene(Host& host, const Caller& caller, const v1::DumpSceneRequest& request, MessageStream& stream) {
  ASSIGN_OR_RETURN(const UsedScene scene, use_scene(host, caller, request.scene(), "scene", LookUp::kMayWait));
  RETURN_IF_ERROR(check_work(caller));
  ASSIGN_OR_RETURN(SnapshotPin snapshot, wait_for(*scene, to_view(request.view()), caller.wait_until(false), caller));
  if (host.cluster != nullptr) RETURN_IF_ERROR(host.cluster->check_view(*scene, request.view()).status());
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, dump_cost(*snapshot)));
  // A caller that reads slowly could keep the snapshot pinned without a time limit. Therefore the call is cancelled
  // when the pin is revoked.
  snapshot.on_revoke([&caller] { caller.cancel(); });
  const auto take = [&](const v1::DumpSceneResponse& piece) {
    return snapshot.status().ok() && caller.stop().ok() && stream.write(piece);
  };
  std::optional<DumpOrder> order;
  {
    const Turns::Turn turn(host.scene_visits);
    RETURN_IF_ERROR(snapshot.status());
    RETURN_IF_ERROR(caller.stop());
    order.emplace(order_of(*snapshot));
  }
  caller.charge_quota(QuotaKind::kWork, static_cast<double>(order->objects.size() + order->instances.size()));
  if (dump_snapshot(*snapshot, *order, take)) return absl::OkStatus();
  RETURN_IF_ERROR(snapshot.status());
  const absl::Status status = caller.stop();
  return status.ok() ? absl::CancelledError("the caller stopped reading") : status;
}

}  // namespace locus::server
