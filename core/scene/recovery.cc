#include "core/scene/recovery.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/scene/log/mesh_codec.h"
#include "core/scene/log/tree_codec.h"
#include "core/scene/record_applier.h"
#include "core/scene/spec_codec.h"

namespace locus {
namespace {

constexpr uint64_t kRecordsPerReport = 64;

std::string hex(const Sha256& sha256) {
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(sha256.data()), sha256.size()));
}

// Returns `status` with `what` added at the beginning of its message; returns OK if `status` is OK.
absl::Status named(absl::string_view what, const absl::Status& status) {
  return status.ok() ? status : absl::Status(status.code(), absl::StrCat(what, ": ", status.message()));
}

// Lookup of the meshes that a snapshot and its later records use. Returns a placeholder for a missing mesh, because the
// mesh may have been deleted after a later record removed its instances. check() reports a placeholder that is still in
// use after the replay. A placeholder has the bounds of the missing mesh, on which it depends which moves of instances
// are refused.
class Meshes {
 public:
  explicit Meshes(const FindMesh& find) : find_(find) {}

  // Returns the mesh of a key. `bounds` are stored with the use of the mesh, except in data formats 1 to 3.
  MeshPtr operator()(const MeshKey& key, const Aabbf* bounds) {
    MeshPtr& mesh = known_[key];
    if (mesh == nullptr) mesh = find_(key);
    if (mesh == nullptr) mesh = placeholder(key, bounds == nullptr ? Aabbf{{0, 0, 0}, {0, 0, 0}} : *bounds);
    return mesh;
  }

  // Returns DATA_LOSS if instances of `statics` use a missing mesh.
  absl::Status check(const StaticSet& statics) const {
    for (const MeshPtr& mesh : placeholders_)
      if (statics.uses(mesh.get()) > 0)
        return data_loss(absl::StrCat("the mesh of content ", hex(mesh->sha256()),
                                      mesh->name().empty() ? "" : " named ", mesh->name(),
                                      " is missing, but instances use it"));
    return absl::OkStatus();
  }

  // Drops the ticks of the history that have instances of a missing mesh, as Scene::forget_mesh() did when the mesh was
  // deleted. Their answers would be wrong, because a placeholder is not the mesh.
  void forget_missing(SceneWriter& writer) const {
    for (const MeshPtr& mesh : placeholders_) writer.forget_mesh(mesh.get());
  }

 private:
  MeshPtr placeholder(const MeshKey& key, const Aabbf& bounds) {
    const Vec3f &min = bounds.min, &max = bounds.max;
    absl::StatusOr<TriangleMesh> triangle =
        TriangleMesh::create({min.x, min.y, min.z, max.x, max.y, max.z}, {0, 1, 0}, {});
    LOCUS_CHECK(triangle.ok());
    absl::StatusOr<MeshPtr> mesh = StaticMesh::build(key.name, key.sha256, *std::move(triangle));
    LOCUS_CHECK(mesh.ok());
    LOCUS_CHECK((*mesh)->bounds() == bounds);
    placeholders_.push_back(*mesh);
    return *mesh;
  }

  const FindMesh& find_;
  std::map<MeshKey, MeshPtr> known_;
  std::vector<MeshPtr> placeholders_;
};

// Replay of the records after a snapshot, in order, by the writer that was restored from the snapshot.
class Replay {
 public:
  Replay(const StoredScene& stored, SceneWriter& writer, Meshes& meshes, const RecoveryProgress& progress)
      : stored_(stored), writer_(writer), meshes_(meshes), progress_(progress), last_(stored.snapshot_sequence) {}

  // Applies the next record. Ignores records that were logged after the scene was looked up.
  absl::Status apply(const LogRecord& record) {
    if (record.sequence > stored_.last_sequence) return absl::OkStatus();
    if (record.sequence != last_ + 1)
      return data_loss(absl::StrCat("record ", record.sequence, " follows record ", last_));
    absl::Status status = enter_epoch(record.entry.epoch);
    absl::StatusOr<Record> decoded = Record::decode(record.entry.bytes);
    if (status.ok()) status = decoded.status();
    const auto find_mesh = [this](const MeshKey& key, const Aabbf* bounds) { return meshes_(key, bounds); };
    if (status.ok()) status = apply_record(writer_, decoded->content(), find_mesh).status();
    if (!status.ok()) return named(absl::StrCat("record ", record.sequence), status);
    last_ = record.sequence;
    if (progress_ != nullptr && (done() % kRecordsPerReport == 0 || last_ == stored_.last_sequence))
      progress_(done(), stored_.last_sequence - stored_.snapshot_sequence);
    return absl::OkStatus();
  }

  // Checks that all records were applied, then starts the epoch that is stored for the scene.
  absl::Status finish() {
    if (last_ != stored_.last_sequence)
      return data_loss(absl::StrCat("records ", last_ + 1, " to ", stored_.last_sequence, " are not there"));
    return enter_epoch(stored_.epoch);
  }

 private:
  uint64_t done() const {
    LOCUS_DCHECK_GE(last_, stored_.snapshot_sequence);
    return last_ - stored_.snapshot_sequence;
  }

  // Starts `epoch` unless it is the current epoch. Returns DATA_LOSS if `epoch` is 0 or an earlier epoch of the scene.
  absl::Status enter_epoch(uint64_t epoch) {
    if (epoch == writer_.epoch()) return absl::OkStatus();
    ended_epochs_.insert(writer_.epoch());
    if (epoch == 0 || ended_epochs_.contains(epoch))
      return data_loss(absl::StrCat("epoch ", epoch, " follows epoch ", writer_.epoch()));
    writer_.restart(epoch);
    return absl::OkStatus();
  }

  const StoredScene& stored_;
  SceneWriter& writer_;
  Meshes& meshes_;
  const RecoveryProgress& progress_;
  uint64_t last_;  // sequence number of the last applied record
  std::set<uint64_t> ended_epochs_;
};

absl::StatusOr<SceneWriter> read_snapshot(const UpdateLog& log, SceneKey key, const SceneSpec& spec, Meshes& meshes) {
  StateReader reader;
  absl::Status status = log.read_snapshot(key, [&reader](absl::string_view chunk) { return reader.add(chunk); });
  if (!status.ok()) return named("snapshot", status);
  const std::map<MeshKey, Aabbf> mesh_bounds = reader.mesh_bounds();
  absl::StatusOr<SceneState> state = std::move(reader).finish([&meshes, &mesh_bounds](const MeshKey& mesh) {
    const auto bounds = mesh_bounds.find(mesh);
    return meshes(mesh, bounds == mesh_bounds.end() ? nullptr : &bounds->second);
  });
  if (!state.ok()) return named("snapshot", state.status());
  absl::StatusOr<SceneWriter> writer =
      SceneWriter::restore(*std::move(state), spec.winding, spec.history, spec.cell_size);
  if (!writer.ok()) return named("snapshot", writer.status());
  return writer;
}

absl::StatusOr<ScenePtr> recover(UpdateLog& log, const StoredScene& stored, const FindMesh& find_mesh,
                                 const RecoveryProgress& progress, LogUse use) {
  if (!stored.damage.ok()) return stored.damage;
  absl::StatusOr<SceneSpec> spec = decode_spec(stored.spec);
  if (!spec.ok()) return named("specification", spec.status());
  Meshes meshes(find_mesh);
  ASSIGN_OR_RETURN(SceneWriter writer, read_snapshot(log, stored.key, *spec, meshes));
  writer.begin_replay();
  Replay replay(stored, writer, meshes, progress);
  const auto apply = [&replay](const LogRecord& record) { return replay.apply(record); };
  RETURN_IF_ERROR(log.read(stored.key, stored.snapshot_sequence + 1, apply));
  RETURN_IF_ERROR(replay.finish());
  RETURN_IF_ERROR(meshes.check(*writer.statics()));
  writer.end_replay();
  meshes.forget_missing(writer);
  SceneLog on;
  if (use == LogUse::kAppend) {
    on = {&log,
          stored.key,
          ack_level(spec->durability),
          {stored.last_sequence, stored.snapshot_sequence, stored.log_bytes}};
  }
  return std::make_shared<Scene>(stored.name, *std::move(spec), std::move(writer), on);
}

// Returns the mesh with the tree of the cached topology. Returns null if no topology is cached or if the cached
// topology is not usable for the mesh; the caller then builds the tree.
MeshPtr restore_mesh(const UpdateLog& log, const StoredMesh& stored, const TriangleMesh& columns,
                     const BvhOptions& options) {
  const std::optional<std::string> kept = log.read_topology(stored.sha256);
  if (!kept) return nullptr;
  const AlignedBytes bytes(*kept);
  const absl::StatusOr<TreeTopology> topology = decode_topology(bytes);
  if (!topology.ok()) return nullptr;
  absl::StatusOr<MeshPtr> mesh = StaticMesh::restore(stored.name, stored.sha256, columns, *topology, options);
  return mesh.ok() ? *std::move(mesh) : nullptr;
}

}  // namespace

absl::StatusOr<ScenePtr> recover_scene(UpdateLog& log, const StoredScene& stored, const FindMesh& find_mesh,
                                       const RecoveryProgress& progress, LogUse use) {
  absl::StatusOr<ScenePtr> scene = recover(log, stored, find_mesh, progress, use);
  if (!scene.ok()) return named(absl::StrCat("scene ", stored.name), scene.status());
  return scene;
}

absl::StatusOr<RecoveredMesh> recover_mesh(UpdateLog& log, const StoredMesh& stored, const BvhOptions& options) {
  const std::string name = absl::StrCat("mesh ", stored.name);
  if (!stored.damage.ok()) return named(name, stored.damage);
  MeshReader reader;
  absl::Status status = log.read_mesh(stored.sha256, [&reader](absl::string_view chunk) { return reader.add(chunk); });
  if (!status.ok()) return named(name, status);
  absl::StatusOr<TriangleMesh> columns = std::move(reader).finish();
  if (!columns.ok()) return named(name, columns.status());
  if (MeshPtr restored = restore_mesh(log, stored, *columns, options); restored != nullptr)
    return RecoveredMesh{std::move(restored), false};
  absl::StatusOr<MeshPtr> mesh = StaticMesh::build(stored.name, stored.sha256, *std::move(columns), options);
  if (!mesh.ok()) return named(name, mesh.status());
  log.store_topology(stored.sha256, encode_topology((*mesh)->tree().topology()));
  return RecoveredMesh{*std::move(mesh), true};
}

absl::StatusOr<MeshPtr> recover_name(const UpdateLog& log, const StoredMesh& stored, const MeshPtr& content) {
  const std::string name = absl::StrCat("mesh ", stored.name);
  if (!stored.damage.ok()) return named(name, stored.damage);
  if (stored.parts_in_content) return StaticMesh::share(stored.name, content->parts(), *content);
  PartsReader reader;
  absl::Status status = log.read_parts(stored.name, [&reader](absl::string_view chunk) { return reader.add(chunk); });
  if (!status.ok()) return named(name, status);
  const std::string creator = reader.creator();
  absl::StatusOr<std::vector<MeshPart>> parts = std::move(reader).finish(content->triangle_count());
  if (!parts.ok()) return named(name, parts.status());
  return StaticMesh::share(stored.name, *std::move(parts), *content, creator);
}

FindMesh find_restored_meshes(const UpdateLog& log, const Registry& registry) {
  return [&log, &registry](const MeshKey& key) -> MeshPtr {
    if (key.name.empty()) {
      for (const StoredMesh& stored : log.stored_meshes())
        if (stored.parts_in_content && stored.sha256 == key.sha256)
          return registry.find_stored({key.sha256, stored.name});
    }
    return registry.find_stored(key);
  };
}

}  // namespace locus
