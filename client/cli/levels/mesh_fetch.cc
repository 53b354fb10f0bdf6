#include "client/cli/levels/mesh_fetch.h"

#include <utility>

#include "client/lib/client.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::StatusOr<ImportedMesh> fetch_mesh(const std::string& name, Context& context, ProgressWriter& progress) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  progress.begin({.action = "downloading", .subject = name, .unit = kProgressBytes});
  absl::StatusOr<client::DownloadedMesh> mesh =
      client->download_mesh(name, [&](uint64_t received, uint64_t total) { progress.update(received, total); });
  RETURN_IF_ERROR(mesh.status());
  ImportedMesh result;
  result.name = name;
  result.vertices = std::move(mesh->vertices);
  result.indices = std::move(mesh->indices);
  for (const v1::MeshPart& part : mesh->parts) result.parts.push_back({part.name(), part.first_triangle()});
  return result;
}

}  // namespace locus::cli
