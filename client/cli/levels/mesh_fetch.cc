#include "client/cli/levels/mesh_fetch.h"

#include <utility>

#include "client/lib/client.h"

namespace locus::cli {

absl::StatusOr<ImportedMesh> fetch_mesh(const std::string& name, Context& context) {
  const absl::StatusOr<client::Client*> client = context.connect();
  if (!client.ok()) return client.status();
  client::DownloadProgress progress;
  if (context.progress() == Progress::kLive) {
    progress = [&](uint64_t received, uint64_t total) {
      constexpr uint64_t kMebibyte = 1u << 20;
      context.err() << "\r\x1b[Kdownloading " << name << ": " << received / kMebibyte << " of " << total / kMebibyte
                    << " MiB" << std::flush;
    };
  }
  absl::StatusOr<client::DownloadedMesh> mesh = (*client)->download_mesh(name, progress);
  if (context.progress() == Progress::kLive) context.err() << "\r\x1b[K" << std::flush;
  if (!mesh.ok()) return mesh.status();
  ImportedMesh result;
  result.name = name;
  result.vertices = std::move(mesh->vertices);
  result.indices = std::move(mesh->indices);
  for (const v1::MeshPart& part : mesh->parts) result.parts.push_back({part.name(), part.first_triangle()});
  return result;
}

}  // namespace locus::cli
