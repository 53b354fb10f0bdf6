#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "core/scene/statics/static_mesh.h"
#include "server/convert/convert.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/creator_quotas.h"
#include "server/services/scene_calls.h"
#include "server/services/sha256.h"

namespace locus::server {
namespace {

// Minimum memory in bytes of each triangle of a mesh: the mesh's tree stores three corners with three coordinates each.
constexpr uint64_t kMinTriangleBytes = 9 * sizeof(float);

absl::Status malformed_upload(absl::string_view field, absl::string_view message) {
  return refuse_argument(Reason::kMalformed, field, {}, message);
}

absl::Status check_count(uint32_t count, uint32_t limit, absl::string_view field, absl::string_view limit_name) {
  if (count == 0) return malformed_upload(field, "a mesh has at least one triangle; announce their number");
  if (count > limit) return refuse_limit(field, limit_name, limit, count);
  return absl::OkStatus();
}

absl::Status check_parts(const v1::UploadMeshRequest& first) {
  if (static_cast<uint32_t>(first.parts_size()) > limits::kMaxMeshParts)
    return refuse_limit("parts", "mesh_parts", limits::kMaxMeshParts, first.parts_size());
  for (int i = 0; i < first.parts_size(); ++i) {
    const uint32_t begin = first.parts(i).first_triangle();
    const bool in_order = i == 0 ? begin == 0 : begin > first.parts(i - 1).first_triangle();
    if (!in_order || begin >= first.triangle_count())
      return refuse_argument(Reason::kMalformed, "parts", static_cast<uint32_t>(i),
                             "the first part must begin at triangle 0, and parts must ascend and lie within the mesh");
    if (first.parts(i).name().size() > limits::kMaxLabelLength)
      return refuse_limit(absl::StrCat("parts[", i, "].name"), "label_length", limits::kMaxLabelLength,
                          static_cast<double>(first.parts(i).name().size()));
  }
  return absl::OkStatus();
}

absl::Status check_first(const v1::UploadMeshRequest& first) {
  RETURN_IF_ERROR(check_mesh_name(first.mesh(), "mesh"));
  if (!first.sha256().empty() && first.sha256().size() != std::tuple_size_v<Sha256>)
    return malformed_upload("sha256", "a SHA-256 has 32 bytes; leave it empty to have it computed");
  RETURN_IF_ERROR(check_count(first.vertex_count(), limits::kMaxMeshVertices, "vertex_count", "mesh_vertices"));
  RETURN_IF_ERROR(check_count(first.triangle_count(), limits::kMaxMeshTriangles, "triangle_count", "mesh_triangles"));
  return check_parts(first);
}

template <class T, class Repeated>
absl::Status append_column(const Repeated& column, size_t announced, absl::string_view field, std::vector<T>* to) {
  const size_t total = to->size() + static_cast<size_t>(column.size());
  if (total > announced)
    return refuse_argument(Reason::kColumnLength, field, {},
                           absl::StrCat("at least ", total, " numbers came, ", announced, " were announced"));
  to->insert(to->end(), column.begin(), column.end());
  return absl::OkStatus();
}

absl::Status check_length(size_t numbers, size_t announced, absl::string_view field) {
  if (numbers == announced) return absl::OkStatus();
  return refuse_argument(Reason::kColumnLength, field, {},
                         absl::StrCat(numbers, " numbers came, ", announced, " were announced"));
}

// A mesh that arrives in pieces. Invariant: its columns never contain more numbers than the first message announced.
// Only one thread at a time may use it.
class MeshUpload {
 public:
  // Checks the first message's form and limits before anything is allocated.
  static absl::StatusOr<MeshUpload> begin(const v1::UploadMeshRequest& first);

  // Appends the columns of `message`, which may be the first message or a later one.
  absl::Status append(const v1::UploadMeshRequest& message);
  // Appends the second or a later message of the upload. Such a message may contain only columns.
  absl::Status append_later(const v1::UploadMeshRequest& message);

  const std::string& name() const { return name_; }
  const std::optional<Sha256>& announced() const { return announced_; }
  // Returns the announced parts; an empty list after finish().
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns whether `mesh` has as many vertices and triangles as were announced.
  bool has_counts_of(const StaticMesh& mesh) const;

  struct Complete {
    Sha256 sha256;
    TriangleMesh mesh;
  };
  // Checks that the upload is complete and correct, and returns the mesh with its hash. Leaves the upload empty.
  absl::StatusOr<Complete> finish();

 private:
  MeshUpload() = default;

  std::string name_;
  std::optional<Sha256> announced_;
  size_t vertex_numbers_ = 0;  // announced length of the column `vertices`, three numbers a vertex
  size_t index_numbers_ = 0;   // announced length of the column `indices`, three numbers a triangle
  std::vector<MeshPart> parts_;
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
};

absl::StatusOr<MeshUpload> MeshUpload::begin(const v1::UploadMeshRequest& first) {
  RETURN_IF_ERROR(check_first(first));
  MeshUpload upload;
  upload.name_ = first.mesh();
  if (!first.sha256().empty()) {
    upload.announced_.emplace();
    std::copy(first.sha256().begin(), first.sha256().end(), upload.announced_->begin());
  }
  upload.vertex_numbers_ = size_t{3} * first.vertex_count();
  upload.index_numbers_ = size_t{3} * first.triangle_count();
  for (const v1::MeshPart& part : first.parts()) upload.parts_.push_back({part.name(), part.first_triangle()});
  return upload;
}

absl::Status MeshUpload::append(const v1::UploadMeshRequest& message) {
  RETURN_IF_ERROR(append_column(message.vertices(), vertex_numbers_, "vertices", &vertices_));
  return append_column(message.indices(), index_numbers_, "indices", &indices_);
}

absl::Status MeshUpload::append_later(const v1::UploadMeshRequest& message) {
  const char* field = !message.mesh().empty()         ? "mesh"
                      : !message.sha256().empty()     ? "sha256"
                      : message.vertex_count() != 0   ? "vertex_count"
                      : message.triangle_count() != 0 ? "triangle_count"
                      : !message.parts().empty()      ? "parts"
                                                      : nullptr;
  if (field != nullptr) return malformed_upload(field, "belongs into the first message of an upload only");
  return append(message);
}

bool MeshUpload::has_counts_of(const StaticMesh& mesh) const {
  return size_t{3} * mesh.vertex_count() == vertex_numbers_ && size_t{3} * mesh.triangle_count() == index_numbers_;
}

absl::StatusOr<MeshUpload::Complete> MeshUpload::finish() {
  RETURN_IF_ERROR(check_length(vertices_.size(), vertex_numbers_, "vertices"));
  RETURN_IF_ERROR(check_length(indices_.size(), index_numbers_, "indices"));
  ASSIGN_OR_RETURN(const Sha256 hash, mesh_hash(vertices_, indices_));
  if (announced_ && *announced_ != hash)
    return refuse_argument(Reason::kHashMismatch, "sha256", {},
                           "the received bytes have another SHA-256; upload them again");
  ASSIGN_OR_RETURN(TriangleMesh mesh,
                   TriangleMesh::create(std::move(vertices_), std::move(indices_), std::move(parts_)));
  return Complete{hash, std::move(mesh)};
}

// Returns the description of a mesh under `name`, with the number of its uses.
v1::Mesh describe_mesh(const Registry& registry, const std::string& name, MeshPtr mesh) {
  const uint32_t uses = registry.mesh_uses(mesh.get());
  return to_proto(Registry::NamedMesh{name, std::move(mesh), uses});
}

// Answers the upload of a mesh whose content is already known: registers the content of `known` under `name` with
// `parts`.
absl::Status reuse(Host& host, const Caller& caller, const std::string& name, const std::vector<MeshPart>& parts,
                   const StaticMesh& known, v1::UploadMeshResponse& response) {
  const MeshPtr shared = StaticMesh::share(name, parts, known, creator_name(caller));
  CallMemory room;  // `room` and `quota` stay empty if `name` exists: then nothing new is stored
  QuotaHold quota;
  if (!host.registry.find_mesh(name, "mesh").ok()) {
    ASSIGN_OR_RETURN(quota, hold_mesh_bytes(host, shared->creator(), shared->bytes()));
    ASSIGN_OR_RETURN(room, caller.claim(MemoryLine::kUploads, "parts", parts_cost(parts)));
  }
  host.mesh_collector.renew(name);
  host.mesh_collector.renew(known.name());
  ASSIGN_OR_RETURN(MeshPtr mesh, host.registry.add_mesh(name, shared));
  response.set_already_known(true);
  *response.mutable_mesh() = describe_mesh(host.registry, name, std::move(mesh));
  return absl::OkStatus();
}

// Refuses or answers the upload before its columns are read, if the first message suffices for that. Returns true if
// the upload has been answered.
absl::StatusOr<bool> answer_early(Host& host, const Caller& caller, const MeshUpload& upload,
                                  v1::UploadMeshResponse& response) {
  const absl::StatusOr<MeshPtr> named = host.registry.find_mesh(upload.name(), "mesh");
  const size_t meshes = host.registry.mesh_count();
  if (!named.ok() && meshes >= host.config.max_meshes)
    return refuse_full("mesh", "meshes", host.config.max_meshes, static_cast<double>(meshes + 1), 0);
  if (!upload.announced()) return false;
  const MeshPtr known = host.registry.find_content(*upload.announced());
  if (known != nullptr && upload.has_counts_of(*known)) {
    RETURN_IF_ERROR(reuse(host, caller, upload.name(), upload.parts(), *known, response));
    return true;
  }
  if (named.ok()) {
    Refusal refusal;
    refusal.reason = Reason::kAlreadyExists;
    refusal.field = "mesh";
    return refuse(absl::StatusCode::kAlreadyExists, "a mesh of other content has this name; choose another name",
                  refusal);
  }
  return false;
}

absl::StatusOr<MeshPtr> build(Host& host, const std::string& name, MeshUpload::Complete complete) {
  const SteadyTime start = SteadyTime::clock::now();
  BvhOptions options;
  options.cancel = host.drain.ended_flag();
  options.parallel_for = [&host](size_t n, const std::function<void(size_t)>& work) {
    host.pool.parallel_for(n, work);
  };
  absl::StatusOr<MeshPtr> built = StaticMesh::build(name, complete.sha256, std::move(complete.mesh), options);
  if (built.ok()) host.metrics.record_mesh_build(nanoseconds_since(start));
  return built;
}

// Answers an upload that is complete: builds the mesh's tree, unless its content is known already, and registers the
// mesh.
absl::Status add_mesh(Host& host, const Caller& caller, MeshUpload& upload, v1::UploadMeshResponse& response) {
  ASSIGN_OR_RETURN(MeshUpload::Complete complete, upload.finish());
  if (const MeshPtr known = host.registry.find_content(complete.sha256); known != nullptr)
    return reuse(host, caller, upload.name(), complete.mesh.parts(), *known, response);
  ASSIGN_OR_RETURN(MeshPtr built, build(host, upload.name(), std::move(complete)));
  built = StaticMesh::share(upload.name(), built->parts(), *built, creator_name(caller));
  ASSIGN_OR_RETURN(const QuotaHold quota, hold_mesh_bytes(host, built->creator(), built->bytes()));
  host.mesh_collector.renew(upload.name());
  ASSIGN_OR_RETURN(MeshPtr added, host.registry.add_mesh(upload.name(), std::move(built)));
  log(LogLevel::kInfo, "mesh uploaded", {{"mesh", upload.name()}});
  *response.mutable_mesh() = describe_mesh(host.registry, upload.name(), std::move(added));
  return absl::OkStatus();
}

absl::Status receive_mesh(Host& host, const Caller& caller, MessageStream& stream, v1::UploadMeshResponse& response) {
  v1::UploadMeshRequest message;
  ASSIGN_OR_RETURN(bool more, stream.read(message));
  if (!more) return malformed_upload("", "an upload needs at least one message, which announces the mesh");
  ASSIGN_OR_RETURN(MeshUpload upload, MeshUpload::begin(message));
  caller.set_subject(upload.name());
  // In a cluster, this server may have read another mesh of the name, which was deleted since.
  if (host.cluster_meshes != nullptr) RETURN_IF_ERROR(host.cluster_meshes->forget_stale(upload.name()));
  ASSIGN_OR_RETURN(const bool answered, answer_early(host, caller, upload, response));
  if (answered) return absl::OkStatus();
  const uint64_t columns = upload_cost(message.vertex_count(), message.triangle_count()) + parts_cost(upload.parts());
  const uint64_t tree = tree_cost(message.triangle_count());
  RETURN_IF_ERROR(hold_mesh_bytes(host, creator_name(caller), kMinTriangleBytes * message.triangle_count()).status());
  // Claim the memory of the tree now too, so that the mesh cannot fail for lack of memory after all its pieces have
  // arrived.
  ASSIGN_OR_RETURN(const CallMemory room, caller.claim(MemoryLine::kUploads, "triangle_count", columns));
  ASSIGN_OR_RETURN(const CallMemory build_room, caller.claim(MemoryLine::kBuilds, "triangle_count", tree));
  RETURN_IF_ERROR(upload.append(message));
  while (true) {
    ASSIGN_OR_RETURN(more, stream.read(message));
    if (!more) break;
    RETURN_IF_ERROR(upload.append_later(message));
  }
  RETURN_IF_ERROR(caller.stop());
  return add_mesh(host, caller, upload, response);
}

}  // namespace

absl::Status upload_mesh(Host& host, const Caller& caller, MessageStream& stream) {
  v1::UploadMeshResponse response;
  RETURN_IF_ERROR(receive_mesh(host, caller, stream, response));
  stream.answer(response);
  return absl::OkStatus();
}

}  // namespace locus::server
