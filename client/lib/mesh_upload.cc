#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/lib/status.h"
#include "client/lib/transfers.h"
#include "core/base/status_macros.h"
#include "grpcpp/client_context.h"

namespace locus::client {
namespace {

// Number of values of a column in one message, chosen so that the encoded message is a little smaller than 1 MiB.
constexpr size_t kValuesPerMessage = (1u << 18) - 1024;
static_assert(kValuesPerMessage % 3 == 0, "messages end between triples");

using Writer = grpc::ClientWriterInterface<v1::UploadMeshRequest>;

absl::Status check(const MeshColumns& mesh) {
  constexpr size_t kMax = std::numeric_limits<uint32_t>::max();
  for (const auto& [name, size] : {std::pair("vertices", mesh.vertices.size()), {"indices", mesh.indices.size()}}) {
    if (size % 3 != 0) {
      return absl::InvalidArgumentError(absl::StrCat(name, " has ", size, " numbers: give three for each entry"));
    }
    if (size / 3 > kMax) return absl::InvalidArgumentError(absl::StrCat(name, " has too many numbers to count"));
  }
  return absl::OkStatus();
}

v1::UploadMeshRequest opening(const MeshColumns& mesh) {
  v1::UploadMeshRequest request;
  request.set_mesh(mesh.name);
  const Sha256 hash = mesh_sha256(mesh.vertices, mesh.indices);
  request.set_sha256(hash.data(), hash.size());
  request.set_vertex_count(static_cast<uint32_t>(mesh.vertices.size() / 3));
  request.set_triangle_count(static_cast<uint32_t>(mesh.indices.size() / 3));
  request.mutable_parts()->Add(mesh.parts.begin(), mesh.parts.end());
  return request;
}

class Sender {
 public:
  Sender(Writer& writer, const MeshColumns& mesh, const UploadProgress& progress)
      : writer_(writer), progress_(progress), total_((mesh.vertices.size() + mesh.indices.size()) * sizeof(uint32_t)) {}

  // Sends `values`, the values of one column, in several messages. Returns false if the server has already answered.
  template <class T, class Column>
  bool send(absl::Span<const T> values, Column column) {
    while (!values.empty()) {
      const absl::Span<const T> part = values.subspan(0, kValuesPerMessage);
      v1::UploadMeshRequest request;
      (request.*column)()->Add(part.begin(), part.end());
      if (!writer_.Write(request)) return false;
      sent_ += part.size() * sizeof(T);
      if (progress_) progress_(sent_, total_);
      values.remove_prefix(part.size());
    }
    return true;
  }

 private:
  Writer& writer_;
  const UploadProgress& progress_;
  const uint64_t total_;
  uint64_t sent_ = 0;
};

}  // namespace

absl::StatusOr<v1::UploadMeshResponse> upload_mesh(v1::SceneService::StubInterface& stub, const MeshColumns& mesh,
                                                   const CallHeader& header, const UploadProgress& progress) {
  RETURN_IF_ERROR(check(mesh));
  CancellableContext context(header.running);
  prepare(context, header);
  v1::UploadMeshResponse response;
  const std::unique_ptr<Writer> writer = stub.UploadMesh(&context, &response);
  Sender sender(*writer, mesh, progress);
  const bool all_sent = writer->Write(opening(mesh)) &&
                        sender.send(mesh.vertices, &v1::UploadMeshRequest::mutable_vertices) &&
                        sender.send(mesh.indices, &v1::UploadMeshRequest::mutable_indices);
  // If a write fails, the server has already answered, and Finish() returns its answer.
  if (all_sent) writer->WritesDone();
  RETURN_IF_ERROR(to_absl_status(writer->Finish()));
  return response;
}

}  // namespace locus::client
