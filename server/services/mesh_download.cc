#include "server/services/mesh_download.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"

namespace locus::server {
namespace {

// Upper bound of the size in bytes of a piece's tags, lengths and description.
constexpr size_t kFrameBytes = 1024;
static_assert(limits::kMaxNameLength + sizeof(Sha256) + 64 < kFrameBytes);
constexpr size_t kRoom = limits::kDefaultReplyBytes - kFrameBytes;
// Bytes of a vertex or a triangle: three numbers of four bytes.
constexpr size_t kTripleBytes = 12;
// Upper bound of the size in bytes of a part: its name, its first triangle, and the tags and lengths of both and of the
// part.
constexpr size_t kMaxPartBytes = limits::kMaxLabelLength + 16;
static_assert(kMaxPartBytes <= kRoom);
// Number of indices that are unpacked at a time.
constexpr uint64_t kIndicesAtOnce = 3 << 14;

// Builder of the pieces of a download. Passes each piece to `take` when the piece is full.
class Pieces {
 public:
  Pieces(const Registry::NamedMesh& mesh, const TakeMeshPiece& take) : take_(take) {
    *piece_.mutable_mesh() = to_proto(mesh);
    piece_.mutable_mesh()->clear_parts();
  }

  void add(const MeshPart& part) {
    make_room(kMaxPartBytes);
    v1::MeshPart* out = piece_.add_parts();
    out->set_name(part.name);
    out->set_first_triangle(part.first_triangle);
    used_ += kMaxPartBytes;
  }

  // Appends `numbers`, which are whole triples, to the column of the current piece that `mutable_column` returns.
  // Begins new pieces as needed.
  template <class T, class Column>
  void add(absl::Span<const T> numbers, Column mutable_column) {
    while (taken_ && !numbers.empty()) {
      make_room(kTripleBytes);
      const absl::Span<const T> some = numbers.subspan(0, (kRoom - used_) / kTripleBytes * 3);
      (piece_.*mutable_column)()->Add(some.begin(), some.end());
      used_ += some.size() * sizeof(T);
      numbers.remove_prefix(some.size());
    }
  }

  bool taken() const { return taken_; }

  bool finish() {
    taken_ = taken_ && take_(piece_);
    return taken_;
  }

 private:
  void make_room(size_t bytes) {
    if (used_ + bytes <= kRoom) return;
    taken_ = taken_ && take_(piece_);
    piece_.Clear();
    used_ = 0;
  }

  const TakeMeshPiece& take_;
  v1::DownloadMeshResponse piece_;
  size_t used_ = 0;  // upper bound of the size in bytes of the piece's columns
  bool taken_ = true;
};

}  // namespace

bool send_mesh(const Registry::NamedMesh& mesh, const TakeMeshPiece& take) {
  const StaticMesh& from = *mesh.mesh;
  Pieces pieces(mesh, take);
  for (const MeshPart& part : from.parts()) pieces.add(part);
  pieces.add(absl::MakeConstSpan(from.vertices()), &v1::DownloadMeshResponse::mutable_vertices);
  PackedIndices::Reader reader = from.indices();
  std::vector<uint32_t> some;
  for (uint64_t left = uint64_t{3} * from.triangle_count(); left > 0 && pieces.taken(); left -= some.size()) {
    some.resize(std::min(left, kIndicesAtOnce));
    for (uint32_t& index : some) index = reader.next();
    pieces.add(absl::MakeConstSpan(some), &v1::DownloadMeshResponse::mutable_indices);
  }
  return pieces.finish();
}

absl::Status download_mesh(Host& host, const Caller& caller, const v1::DownloadMeshRequest& request,
                           grpc::ServerWriter<v1::DownloadMeshResponse>& writer) {
  RETURN_IF_ERROR(check_mesh_name(request.mesh(), "mesh"));
  ASSIGN_OR_RETURN(MeshPtr mesh, host.registry.find_mesh(request.mesh(), "mesh"));
  // Claim memory for a copy of the vertices, into which they are unpacked.
  ASSIGN_OR_RETURN(const MemoryBudget::Claim claim,
                   host.memory.claim("mesh", uint64_t{kTripleBytes} * mesh->vertex_count()));
  const uint32_t uses = host.registry.mesh_uses(mesh.get());
  const auto take = [&](const v1::DownloadMeshResponse& piece) { return caller.stop().ok() && writer.Write(piece); };
  if (send_mesh({request.mesh(), std::move(mesh), uses}, take)) return absl::OkStatus();
  const absl::Status status = caller.stop();
  return status.ok() ? absl::CancelledError("the caller stopped reading") : status;
}

}  // namespace locus::server
