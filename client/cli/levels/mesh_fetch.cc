#include "client/cli/levels/mesh_fetch.h"

#include <utility>

#include "client/lib/client.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::StatusOr<ImportedMesh> fetch_mesh(const std::string& name, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  client::DownloadProgress progress;
  if (context.progress() == Progress::kLive) {
    progress = [&](uint64_t received, uint64_t total) {
      constexpr uint64_t kMebibyte = 1u << 20;
      context.err() << "\r\x1b[Kdownloading " << name << ": " << received / kMebibyte << " of " << total / kMebibyte
                    << " MiB" << std::flush;
    };
  }
  absl::StatusOr<client::DownloadedMesh> mesh = client->download_mesh(name, progress);
  if (context.progress() == Progress::kLive) context.err() << "\r\x1b[K" << std::flush;
  RETURN_IF_ERROR(mesh.status());
  ImportedMesh result;
  result.name = name;
  result.vertices = std::move(mesh->vertices);
  result.indices = std::move(mesh->indices);
  for (const v1::MeshPart& part : mesh->parts) result.parts.push_back({part.name(), part.first_triangle()});
  return result;
}

}  // namespace locus::cli
