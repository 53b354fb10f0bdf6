#include <algorithm>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/lib/status.h"
#include "client/lib/transfers.h"
#include "core/base/status_macros.h"
#include "grpcpp/client_context.h"
#include "grpcpp/support/client_callback.h"
#include "locus/v1/scene_service.grpc.pb.h"

namespace locus::client {
namespace {

// Number of values of a column in one message, chosen so that the encoded message is a little smaller than 1 MiB.
constexpr size_t kValuesPerMessage = (1u << 18) - 1024;
static_assert(kValuesPerMessage % 3 == 0, "messages end between triples");

// Writes the messages of one call, each in turn. Unlike gRPC's blocking writer it waits for the status of the call from
// the beginning: over an in-process channel of gRPC 1.51, a write would otherwise not end when the server has answered
// without reading the message. Used by one thread.
class Writer final : public grpc::ClientWriteReactor<v1::UploadMeshRequest> {
 public:
  // Starts the call. Call finish() before the destructor.
  Writer(v1::SceneService::StubInterface& stub, grpc::ClientContext& context) {
    stub.async()->UploadMesh(&context, &response_, this);
    AddHold();  // keeps the call from ending between two writes
    StartCall();
  }

  // Returns false if the server has already answered.
  bool write(const v1::UploadMeshRequest& request) {
    std::unique_lock lock(mutex_);
    state_ = State::kWriting;
    StartWrite(&request);
    changed_.wait(lock, [this] { return state_ != State::kWriting; });
    return state_ == State::kWritten;
  }
  void end_writes() { StartWritesDone(); }
  // Waits for the answer.
  absl::StatusOr<v1::UploadMeshResponse> finish() {
    RemoveHold();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return end_.has_value(); });
    RETURN_IF_ERROR(*end_);
    return std::move(response_);
  }

 private:
  enum class State { kWriting, kWritten, kAnswered };

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    state_ = ok ? State::kWritten : State::kAnswered;
    changed_.notify_all();
  }
  void OnDone(const grpc::Status& status) override {
    const std::lock_guard lock(mutex_);
    end_ = to_absl_status(status);
    changed_.notify_all();
  }

  v1::UploadMeshResponse response_;
  std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::kWritten;
  std::optional<absl::Status> end_;
};

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
      if (!writer_.write(request)) return false;
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
  Writer writer(stub, context);
  Sender sender(writer, mesh, progress);
  const bool all_sent = writer.write(opening(mesh)) &&
                        sender.send(mesh.vertices, &v1::UploadMeshRequest::mutable_vertices) &&
                        sender.send(mesh.indices, &v1::UploadMeshRequest::mutable_indices);
  if (all_sent) writer.end_writes();
  return writer.finish();
}

}  // namespace locus::client
