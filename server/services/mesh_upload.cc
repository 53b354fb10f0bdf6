#include "server/services/mesh_upload.h"

#include <openssl/evp.h>

#include <bit>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are hashed as they lie in memory");

absl::Status malformed_upload(absl::string_view field, absl::string_view message) {
  return refuse_argument(Reason::kMalformed, field, {}, message);
}

absl::Status check_count(uint32_t count, uint32_t limit, absl::string_view field, absl::string_view limit_name) {
  if (count == 0) return malformed_upload(field, "a mesh has at least one triangle; say how many come");
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
                             "parts begin at triangle 0, ascend and lie within the mesh");
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

// Returns the description of a mesh under `name`, with the number of its uses.
v1::Mesh describe_mesh(const Registry& registry, const std::string& name, MeshPtr mesh) {
  const uint32_t uses = registry.mesh_uses(mesh.get());
  return to_proto(Registry::NamedMesh{name, std::move(mesh), uses});
}

// Answers the upload of a mesh whose content is already known: registers the content of `known` under `name` with
// `parts`.
absl::Status reuse(Host& host, const std::string& name, const std::vector<MeshPart>& parts, const StaticMesh& known,
                   v1::UploadMeshResponse* response) {
  ASSIGN_OR_RETURN(MeshPtr mesh, host.registry.add_mesh(name, StaticMesh::share(name, parts, known)));
  response->set_already_known(true);
  *response->mutable_mesh() = describe_mesh(host.registry, name, std::move(mesh));
  return absl::OkStatus();
}

// Refuses or answers the upload before its columns are read, if that is possible. Returns true if it has been answered.
absl::StatusOr<bool> answer_early(Host& host, const MeshUpload& upload, v1::UploadMeshResponse* response) {
  const absl::StatusOr<MeshPtr> named = host.registry.find_mesh(upload.name(), "mesh");
  const size_t meshes = host.registry.mesh_count();
  if (!named.ok() && meshes >= host.config.max_meshes)
    return refuse_full("mesh", "meshes", host.config.max_meshes, static_cast<double>(meshes + 1), 0);
  if (!upload.announced()) return false;
  const MeshPtr known = host.registry.find_content(*upload.announced());
  if (known != nullptr && upload.has_counts_of(*known)) {
    const absl::Status status = reuse(host, upload.name(), upload.parts(), *known, response);
    if (!status.ok()) return status;
    return true;
  }
  if (named.ok()) {
    Refusal refusal;
    refusal.reason = Reason::kAlreadyExists;
    refusal.field = "mesh";
    return refuse(absl::StatusCode::kAlreadyExists, "the name is taken by other bytes; choose another", refusal);
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

}  // namespace

Sha256 mesh_hash(absl::Span<const float> vertices, absl::Span<const uint32_t> indices) {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  const std::array<uint32_t, 2> counts = {static_cast<uint32_t>(vertices.size() / 3),
                                          static_cast<uint32_t>(indices.size() / 3)};
  Sha256 hash{};
  unsigned length = 0;
  const bool done = EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1 &&
                    EVP_DigestUpdate(context.get(), counts.data(), sizeof counts) == 1 &&
                    EVP_DigestUpdate(context.get(), vertices.data(), vertices.size() * sizeof(float)) == 1 &&
                    EVP_DigestUpdate(context.get(), indices.data(), indices.size() * sizeof(uint32_t)) == 1 &&
                    EVP_DigestFinal_ex(context.get(), hash.data(), &length) == 1;
  LOCUS_CHECK(done);
  LOCUS_CHECK_EQ(length, hash.size());
  return hash;
}

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
  const Sha256 hash = mesh_hash(vertices_, indices_);
  if (announced_ && *announced_ != hash)
    return refuse_argument(Reason::kHashMismatch, "sha256", {},
                           "the bytes that came have another SHA-256; upload them again");
  ASSIGN_OR_RETURN(TriangleMesh mesh,
                   TriangleMesh::create(std::move(vertices_), std::move(indices_), std::move(parts_)));
  return Complete{hash, std::move(mesh)};
}

absl::Status upload_mesh(Host& host, const Caller& caller, grpc::ServerReader<v1::UploadMeshRequest>& reader,
                         v1::UploadMeshResponse* response) {
  v1::UploadMeshRequest message;
  if (!reader.Read(&message)) return malformed_upload("", "an upload has at least one message, which says what comes");
  ASSIGN_OR_RETURN(MeshUpload upload, MeshUpload::begin(message));
  const absl::StatusOr<bool> answered = answer_early(host, upload, response);
  if (!answered.ok() || *answered) return answered.status();
  ASSIGN_OR_RETURN(const MemoryBudget::Claim room,
                   host.memory.claim("triangle_count", upload_cost(message.vertex_count(), message.triangle_count())));
  absl::Status status = upload.append(message);
  while (status.ok() && reader.Read(&message)) status = upload.append_later(message);
  if (status.ok()) status = caller.stop();
  if (!status.ok()) return status;
  ASSIGN_OR_RETURN(MeshUpload::Complete complete, upload.finish());
  if (const MeshPtr known = host.registry.find_content(complete.sha256); known != nullptr)
    return reuse(host, upload.name(), complete.mesh.parts(), *known, response);
  ASSIGN_OR_RETURN(MeshPtr built, build(host, upload.name(), std::move(complete)));
  ASSIGN_OR_RETURN(MeshPtr added, host.registry.add_mesh(upload.name(), std::move(built)));
  log(LogLevel::kInfo, "mesh uploaded", {{"mesh", upload.name()}});
  *response->mutable_mesh() = describe_mesh(host.registry, upload.name(), std::move(added));
  return absl::OkStatus();
}

}  // namespace locus::server
