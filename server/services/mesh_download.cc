#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "core/scene/registry.h"
#include "server/convert/convert.h"
#include "server/services/scene_access.h"
#include "server/services/scene_calls.h"

namespace locus::server {
namespace {

// Upper bound of the size in bytes of everything in a piece except its parts, vertices and indices: the description of
// the mesh, and the protobuf tags and lengths of the columns.
constexpr size_t kFrameBytes = 1024;
static_assert(limits::kMaxNameLength + sizeof(Sha256) + 64 < kFrameBytes);
constexpr size_t kRoom = limits::kDefaultReplyBytes - kFrameBytes;
// Bytes of a vertex or a triangle: three numbers of four bytes.
constexpr size_t kTripleBytes = 12;
// Upper bound of the size in bytes of a part: its name and its first triangle, and the protobuf tags and lengths of
// these two fields and of the part.
constexpr size_t kMaxPartBytes = limits::kMaxLabelLength + 16;
static_assert(kMaxPartBytes <= kRoom);
// Number of indices that are unpacked at a time.
constexpr uint64_t kIndicesAtOnce = 3 << 14;

// Function that writes a piece to the caller; returns false to end the download.
using TakeMeshPiece = std::function<bool(const v1::DownloadMeshResponse&)>;

// Builder of the pieces of a download. Passes each piece to `take` when the piece is full.
class Pieces {
 public:
  Pieces(const Registry::NamedMesh& mesh, const TakeMeshPiece& take) : take_(take) {
    *piece_.mutable_mesh() = to_proto(mesh, 0, 0);
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

// Sends the description, then parts, vertices and indices. Sends at least one piece; every piece except the last one is
// full. Returns false if `take` ended the download.
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

// Returns the maximum memory in bytes that a download needs at any time, for an unpacked copy of the vertices and for
// one piece. The piece exists as a message, whose columns double as they grow, and as bytes.
uint64_t download_cost(const StaticMesh& mesh) {
  const uint64_t columns =
      uint64_t{kTripleBytes} * mesh.vertex_count() + uint64_t{kTripleBytes} * mesh.triangle_count();
  return uint64_t{kTripleBytes} * mesh.vertex_count() +
         3 * std::min<uint64_t>(columns + parts_cost(mesh.parts()), limits::kDefaultReplyBytes);
}

}  // namespace

absl::Status download_mesh(Host& host, const Caller& caller, const v1::DownloadMeshRequest& request,
                           MessageStream& stream) {
  RETURN_IF_ERROR(check_mesh_name(request.mesh(), "mesh"));
  ASSIGN_OR_RETURN(MeshPtr mesh, find_mesh(host, request.mesh()));
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, download_cost(*mesh)));
  const uint32_t uses = host.registry.mesh_uses(mesh.get());
  const auto take = [&](const v1::DownloadMeshResponse& piece) { return caller.stop().ok() && stream.write(piece); };
  if (send_mesh({request.mesh(), std::move(mesh), uses}, take)) return absl::OkStatus();
  const absl::Status status = caller.stop();
  return status.ok() ? absl::CancelledError("the caller stopped reading") : status;
}

}  // namespace locus::server
