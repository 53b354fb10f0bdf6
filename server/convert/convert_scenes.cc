#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>

#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"

namespace locus::server {
namespace {

// Upper bound of the size in bytes of the protobuf tag and length of a mesh part.
constexpr size_t kPartFrameBytes = 4;

v1::Durability to_proto(Durability durability) {
  switch (durability) {
    case Durability::kLocal:
      return v1::DURABILITY_LOCAL;
    case Durability::kMemory:
      return v1::DURABILITY_MEMORY;
    case Durability::kReplicated:
      return v1::DURABILITY_REPLICATED;
  }
  return v1::DURABILITY_UNSPECIFIED;
}

v1::HistoryLimit to_proto(PastLimit limit) {
  switch (limit) {
    case PastLimit::kOff:
      return v1::HISTORY_LIMIT_UNSPECIFIED;
    case PastLimit::kBegan:
      return v1::HISTORY_LIMIT_BEGAN;
    case PastLimit::kTicks:
      return v1::HISTORY_LIMIT_TICKS;
    case PastLimit::kBytes:
      return v1::HISTORY_LIMIT_BYTES;
    case PastLimit::kMemory:
      return v1::HISTORY_LIMIT_MEMORY;
    case PastLimit::kRestored:
      return v1::HISTORY_LIMIT_RESTORED;
  }
  return v1::HISTORY_LIMIT_UNSPECIFIED;
}

absl::Status check_served(const v1::SceneSpec& spec) {
  if (!v1::Durability_IsValid(spec.durability())) return unknown_enum("spec.durability", spec.durability());
  if (!v1::Winding_IsValid(spec.winding())) return unknown_enum("spec.winding", spec.winding());
  if (!v1::OverloadPolicy_IsValid(spec.overload())) return unknown_enum("spec.overload", spec.overload());
  return absl::OkStatus();
}

absl::Status check_lifetime(uint32_t seconds, absl::string_view field, absl::string_view limit) {
  if (seconds <= limits::kMaxLifetimeSeconds) return absl::OkStatus();
  return refuse_limit(field, limit, limits::kMaxLifetimeSeconds, seconds);
}

absl::StatusOr<HistoryOptions> to_history(const v1::SceneSpec& spec) {
  if (spec.history_ticks() > limits::kMaxHistoryTicks)
    return refuse_limit("spec.history_ticks", "history_ticks", limits::kMaxHistoryTicks, spec.history_ticks());
  if (spec.history_bytes() > limits::kMaxHistoryBytes)
    return refuse_limit("spec.history_bytes", "history_bytes", static_cast<double>(limits::kMaxHistoryBytes),
                        static_cast<double>(spec.history_bytes()));
  if (spec.history_ticks() == 0) {
    if (spec.history_bytes() == 0) return HistoryOptions();
    return refuse_argument(Reason::kMalformed, "spec.history_bytes", {},
                           "needs history_ticks, the number of ticks to be kept; or leave both at 0");
  }
  return HistoryOptions{spec.history_ticks(),
                        spec.history_bytes() == 0 ? limits::kDefaultHistoryBytes : spec.history_bytes()};
}

absl::StatusOr<PlacementColumns> to_placement(const v1::Placement& placement, const Registry& registry,
                                              const std::string& field) {
  RETURN_IF_ERROR(check_mesh_name(placement.mesh(), field));
  PlacementColumns columns;
  ASSIGN_OR_RETURN(columns.mesh, registry.find_mesh(placement.mesh(), field));
  columns.ids = span_of(placement.ids());
  columns.translations = span_of(placement.translations());
  columns.rotations = span_of(placement.rotations());
  columns.scales = span_of(placement.scales());
  columns.layers = span_of(placement.layers());
  columns.groups = span_of(placement.groups());
  columns.tags = span_of(placement.tags());
  return columns;
}

}  // namespace

Vec3d to_vec(const v1::Vec3d& vec) { return {vec.x(), vec.y(), vec.z()}; }

v1::Vec3d to_proto(const Vec3d& vec) {
  v1::Vec3d out;
  out.set_x(vec.x);
  out.set_y(vec.y);
  out.set_z(vec.z);
  return out;
}

View to_view(const v1::View& view) {
  View out;
  out.epoch = view.epoch();
  if (view.revision_case() == v1::View::kAtLeast) {
    out.kind = View::Kind::kAtLeast;
    out.revision = view.at_least();
  } else if (view.revision_case() == v1::View::kExactly) {
    out.kind = View::Kind::kExactly;
    out.revision = view.exactly();
  }
  return out;
}

absl::StatusOr<StaticChange> to_change(const v1::ChangeInstancesRequest& request, const Registry& registry) {
  StaticChange change;
  change.remove_ids = span_of(request.remove_ids());
  change.remove_groups = span_of(request.remove_groups());
  change.place.reserve(static_cast<size_t>(request.place_size()));
  for (int i = 0; i < request.place_size(); ++i) {
    ASSIGN_OR_RETURN(PlacementColumns placement,
                     to_placement(request.place(i), registry, absl::StrCat("place[", i, "].mesh")));
    change.place.push_back(std::move(placement));
  }
  return change;
}

absl::Status check_labels(const google::protobuf::Map<std::string, std::string>& labels, const std::string& field) {
  if (labels.size() > limits::kMaxLabels)
    return refuse_limit(field, "labels", limits::kMaxLabels, static_cast<double>(labels.size()));
  for (const auto& [key, value] : labels) {
    const size_t longest = std::max(key.size(), value.size());
    if (longest > limits::kMaxLabelLength)
      return refuse_limit(field, "label_length", limits::kMaxLabelLength, static_cast<double>(longest));
  }
  return absl::OkStatus();
}

absl::StatusOr<double> to_cell_size(double size, absl::string_view field) {
  if (!std::isfinite(size)) return refuse_argument(Reason::kNotFinite, field, {}, "a cell size is a number");
  if (size == 0) return 0.0;
  if (size < kMinCellSize || size > kMaxCellSize)
    return refuse_argument(Reason::kOutOfRange, field, {},
                           absl::StrCat("a cell size is 0, which lets the server choose, or ", kMinCellSize, " to ",
                                        kMaxCellSize, ", not ", size));
  int exponent = 0;
  const double fraction = std::frexp(size, &exponent);  // 0.5 <= fraction < 1
  return std::ldexp(1.0, fraction == 0.5 ? exponent - 1 : exponent);
}

absl::StatusOr<SettingsChange> to_settings(const v1::UpdateSceneRequest& request) {
  const auto& unknown = request.GetReflection()->GetUnknownFields(request);
  if (!unknown.empty())
    return refuse_argument(Reason::kMalformed, absl::StrCat("field ", unknown.field(0).number()), {},
                           "this server knows no such setting; cell_size and labels can be changed");
  if (request.fields().empty())
    return refuse_argument(Reason::kMalformed, "fields", {}, "name what to change: cell_size, labels or both");
  SettingsChange change;
  for (int i = 0; i < request.fields_size(); ++i) {
    const std::string& field = request.fields(i);
    if (field == "labels") {
      RETURN_IF_ERROR(check_labels(request.labels(), "labels"));
      change.labels.emplace(request.labels().begin(), request.labels().end());
    } else if (field == "cell_size") {
      ASSIGN_OR_RETURN(change.cell_size, to_cell_size(request.cell_size(), "cell_size"));
    } else {
      return refuse_argument(Reason::kMalformed, "fields", static_cast<uint32_t>(i),
                             absl::StrCat("'", absl::CHexEscape(field.substr(0, limits::kMaxNameLength)),
                                          "' cannot be changed after the scene was created; cell_size and labels can"));
    }
  }
  const absl::string_view unnamed = request.cell_size() != 0 && !change.cell_size ? "cell_size"
                                    : !request.labels().empty() && !change.labels ? "labels"
                                                                                  : "";
  if (!unnamed.empty())
    return refuse_argument(Reason::kMalformed, unnamed, {}, "a new value needs its name in `fields`");
  return change;
}

absl::StatusOr<SceneSpec> to_spec(const v1::SceneSpec& spec) {
  RETURN_IF_ERROR(check_served(spec));
  RETURN_IF_ERROR(check_labels(spec.labels(), "spec.labels"));
  ASSIGN_OR_RETURN(const HistoryOptions history, to_history(spec));
  RETURN_IF_ERROR(check_lifetime(spec.idle_ttl_s(), "spec.idle_ttl_s", "idle_ttl_s"));
  RETURN_IF_ERROR(check_lifetime(spec.mesh_grace_s(), "spec.mesh_grace_s", "mesh_grace_s"));
  SceneSpec out;
  ASSIGN_OR_RETURN(out.cell_size, to_cell_size(spec.cell_size(), "spec.cell_size"));
  out.history = history;
  out.idle_ttl_s = spec.idle_ttl_s();
  out.mesh_grace_s = spec.mesh_grace_s();
  out.labels.insert(spec.labels().begin(), spec.labels().end());
  out.winding = spec.winding() == v1::WINDING_CLOCKWISE ? Winding::kClockwise : Winding::kCounterClockwise;
  if (spec.overload() == v1::OVERLOAD_POLICY_LATEST_WINS) out.overload = OverloadPolicy::kLatestWins;
  if (spec.durability() == v1::DURABILITY_MEMORY) out.durability = Durability::kMemory;
  if (spec.durability() == v1::DURABILITY_REPLICATED) out.durability = Durability::kReplicated;
  return out;
}

v1::SceneSpec spec_to_proto(const SceneSpec& spec, const SceneSettings& settings) {
  v1::SceneSpec out;
  for (const auto& [key, value] : settings.labels) (*out.mutable_labels())[key] = value;
  out.set_cell_size(settings.cell_size);
  out.set_history_ticks(spec.history.ticks);
  out.set_history_bytes(spec.history.bytes);
  out.set_idle_ttl_s(spec.idle_ttl_s);
  out.set_mesh_grace_s(spec.mesh_grace_s);
  out.set_durability(to_proto(spec.durability));
  out.set_winding(spec.winding == Winding::kClockwise ? v1::WINDING_CLOCKWISE : v1::WINDING_COUNTER_CLOCKWISE);
  out.set_overload(spec.overload == OverloadPolicy::kLatestWins ? v1::OVERLOAD_POLICY_LATEST_WINS
                                                                : v1::OVERLOAD_POLICY_EVERY_BATCH);
  return out;
}

v1::Scene to_proto(const Scene& scene, const SceneSummary& summary) {
  const SceneStatus status = scene.status();
  v1::Scene out;
  out.set_name(scene.name());
  *out.mutable_spec() = spec_to_proto(scene.spec(), scene.settings());
  if (scene.log_key() == 0) out.mutable_spec()->set_durability(v1::DURABILITY_MEMORY);
  out.set_state(status.pending_changes > 0 ? v1::SCENE_STATE_BUILDING : v1::SCENE_STATE_READY);
  out.set_epoch(summary.epoch);
  out.set_revision(summary.revision);
  out.set_tick(summary.tick);
  out.set_oldest_tick(summary.oldest_tick);
  out.set_recorded_ticks(status.recorded_ticks);
  out.set_history_bytes(status.history_bytes);
  out.set_pinned_bytes(status.pinned_bytes);
  out.set_max_pinned_bytes(status.max_pinned_bytes);
  out.set_objects(summary.objects);
  out.set_instances(summary.instances);
  out.set_triangles(summary.triangles);
  out.set_memory_bytes(status.memory_bytes);
  out.set_mesh_bytes(status.mesh_bytes);
  out.set_recent_bytes(status.recent_bytes);
  out.set_history_limit(to_proto(status.past_limit));
  out.set_forgotten_ticks(status.forgotten_ticks);
  out.set_pending_changes(status.pending_changes);
  out.set_joined_updates(status.joined_updates);
  out.set_last_build_error(status.last_build_error);
  if (!summary.bounds.empty()) {
    *out.mutable_min() = to_proto(summary.bounds.min);
    *out.mutable_max() = to_proto(summary.bounds.max);
  }
  return out;
}

v1::Source to_proto(Source source) {
  switch (source) {
    case Source::kBoth:
      return v1::SOURCE_BOTH;
    case Source::kStatic:
      return v1::SOURCE_STATIC;
    case Source::kDynamic:
      return v1::SOURCE_DYNAMIC;
  }
  return v1::SOURCE_UNSPECIFIED;
}

v1::Mesh to_proto(const Registry::NamedMesh& mesh, size_t first_part, size_t max_part_bytes) {
  v1::Mesh out;
  out.set_name(mesh.name);
  const Sha256& sha256 = mesh.mesh->sha256();
  out.set_sha256(sha256.data(), sha256.size());
  out.set_vertices(mesh.mesh->vertex_count());
  out.set_triangles(mesh.mesh->triangle_count());
  out.set_zero_area_triangles(mesh.mesh->zero_area_count());
  out.set_open_edges(mesh.mesh->open_edges());
  out.set_bytes(mesh.mesh->bytes());
  out.set_uses(mesh.uses);
  const std::vector<MeshPart>& parts = mesh.mesh->parts();
  out.set_part_count(static_cast<uint32_t>(parts.size()));
  size_t bytes = 0;
  for (size_t i = first_part; i < parts.size(); ++i) {
    v1::MeshPart part;
    part.set_name(parts[i].name);
    part.set_first_triangle(parts[i].first_triangle);
    bytes += part.ByteSizeLong() + kPartFrameBytes;
    if (bytes > max_part_bytes) break;
    *out.add_parts() = std::move(part);
  }
  return out;
}

}  // namespace locus::server
