#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/lib/status.h"
#include "client/lib/transfers.h"
#include "core/base/status_macros.h"
#include "grpcpp/client_context.h"

namespace locus::client {
namespace {

absl::Status damaged(absl::string_view name, absl::string_view what) {
  return absl::DataLossError(absl::StrCat("mesh ", name, " came damaged: ", what, "; download it again"));
}

// Appends `column` of a message to `to`. Returns false and appends nothing if `to` would have more than `announced`
// entries.
template <class T, class Repeated>
bool append(const Repeated& column, size_t announced, std::vector<T>* to) {
  if (static_cast<size_t>(column.size()) > announced - to->size()) return false;
  to->insert(to->end(), column.begin(), column.end());
  return true;
}

class MeshReceiver {
 public:
  MeshReceiver(absl::string_view name, const DownloadProgress& progress) : name_(name), progress_(progress) {}

  absl::Status receive(v1::DownloadMeshResponse& message) {
    if (message.has_mesh() != first_) return damaged(name_, "its description is not exactly in the first message");
    if (first_) begin(message);
    if (!append(message.parts(), mesh_.description.triangles(), &mesh_.parts) ||
        !append(message.vertices(), vertex_values_, &mesh_.vertices) ||
        !append(message.indices(), index_values_, &mesh_.indices))
      return damaged(name_, "more came than was announced");
    if (progress_) {
      progress_((mesh_.vertices.size() + mesh_.indices.size()) * sizeof(uint32_t),
                (vertex_values_ + index_values_) * sizeof(uint32_t));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<DownloadedMesh> finish() {
    if (first_) return damaged(name_, "nothing came");
    if (mesh_.vertices.size() != vertex_values_ || mesh_.indices.size() != index_values_)
      return damaged(name_, "less came than was announced");
    const size_t vertices = vertex_values_ / 3;
    if (std::any_of(mesh_.indices.begin(), mesh_.indices.end(), [=](uint32_t index) { return index >= vertices; }))
      return damaged(name_, "an index is beyond its vertices");
    if (!std::all_of(mesh_.vertices.begin(), mesh_.vertices.end(), [](float value) { return std::isfinite(value); }))
      return damaged(name_, "a vertex is not finite");
    if (!parts_ascend()) return damaged(name_, "its parts do not ascend from triangle 0 within it");
    const Sha256 hash = mesh_sha256(mesh_.vertices, mesh_.indices);
    if (!std::equal(hash.begin(), hash.end(), mesh_.description.sha256().begin(), mesh_.description.sha256().end(),
                    [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); }))
      return damaged(name_, "its bytes have another SHA-256 than was announced");
    return std::move(mesh_);
  }

 private:
  void begin(v1::DownloadMeshResponse& message) {
    first_ = false;
    mesh_.description = std::move(*message.mutable_mesh());
    vertex_values_ = size_t{3} * mesh_.description.vertices();
    index_values_ = size_t{3} * mesh_.description.triangles();
  }

  bool parts_ascend() const {
    for (size_t i = 0; i < mesh_.parts.size(); ++i) {
      const uint32_t first = mesh_.parts[i].first_triangle();
      const bool in_order = i == 0 ? first == 0 : first > mesh_.parts[i - 1].first_triangle();
      if (!in_order || first >= mesh_.description.triangles()) return false;
    }
    return true;
  }

  const absl::string_view name_;
  const DownloadProgress& progress_;
  bool first_ = true;
  size_t vertex_values_ = 0;
  size_t index_values_ = 0;
  DownloadedMesh mesh_;
};

}  // namespace

absl::StatusOr<DownloadedMesh> download_mesh(v1::SceneService::StubInterface& stub, absl::string_view name,
                                             const CallHeader& header, const DownloadProgress& progress) {
  CancellableContext context(header.running);
  prepare(context, header);
  v1::DownloadMeshRequest request;
  request.set_mesh(std::string(name));
  const auto reader = stub.DownloadMesh(&context, request);
  MeshReceiver receiver(name, progress);
  v1::DownloadMeshResponse message;
  absl::Status received;
  while (received.ok() && reader->Read(&message)) received = receiver.receive(message);
  if (!received.ok()) context.TryCancel();
  const absl::Status end = to_absl_status(reader->Finish());
  RETURN_IF_ERROR(received);
  RETURN_IF_ERROR(end);
  return receiver.finish();
}

}  // namespace locus::client
