#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/levels/mesh_fetch.h"
#include "client/cli/levels/obj_file.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct MeshOptions {
  std::string name;
  std::string out;
};

Json mesh_summary(const v1::Mesh& mesh) {
  return {{"name", mesh.name()},
          {"triangles", mesh.triangles()},
          {"vertices", mesh.vertices()},
          {"uses", mesh.uses()},
          {"parts", std::max<int64_t>(mesh.part_count(), mesh.parts_size())},  // older servers send no count
          {"zero_area_triangles", mesh.zero_area_triangles()},
          {"open_edges", mesh.open_edges()},
          {"bytes", mesh.bytes()},
          {"sha256", absl::BytesToHexString(mesh.sha256())}};
}

absl::Status list_meshes(const MeshOptions&, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const std::vector<v1::Mesh> meshes, client->list_meshes(client::MeshParts::kNone));
  Report report;
  report.rows_name = "meshes";
  report.no_rows = "no meshes";
  report.keys = {"name", "triangles", "vertices", "uses", "parts", "zero_area_triangles", "bytes"};
  for (const v1::Mesh& mesh : meshes) {
    Json row = mesh_summary(mesh);
    row.erase("sha256");
    row.erase("open_edges");
    report.rows.push_back(std::move(row));
  }
  context.write(report);
  return absl::OkStatus();
}

absl::Status show(const MeshOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const absl::StatusOr<v1::Mesh> found = client->get_mesh(options.name);
  if (absl::IsNotFound(found.status()))
    return absl::NotFoundError(absl::StrCat("no mesh is named ", options.name, ": `locus mesh list` shows which are"));
  RETURN_IF_ERROR(found.status());
  const v1::Mesh& mesh = *found;
  Report report;
  report.head = mesh_summary(mesh);
  report.rows_name = "parts";
  report.no_rows = "no parts";
  report.keys = {"part", "first_triangle", "triangles"};
  for (int part = 0; part < mesh.parts_size(); ++part) {
    const uint32_t first = mesh.parts(part).first_triangle();
    const uint32_t end = part + 1 < mesh.parts_size() ? mesh.parts(part + 1).first_triangle() : mesh.triangles();
    report.rows.push_back({{"part", mesh.parts(part).name()}, {"first_triangle", first}, {"triangles", end - first}});
  }
  report.head.erase("parts");
  context.write(report);
  return absl::OkStatus();
}

absl::Status download(const MeshOptions& options, Context& context) {
  ProgressWriter progress = start_progress(context);
  ASSIGN_OR_RETURN(const ImportedMesh mesh, fetch_mesh(options.name, context, progress));
  progress.begin({.action = "writing", .subject = options.out});
  std::ofstream file(options.out, std::ios::trunc);
  write_obj(file, mesh);
  file.close();
  progress.hide();
  if (!file)
    return absl::FailedPreconditionError(absl::StrCat("cannot write ", options.out, ": check its folder and space"));
  Report report;
  report.head = {{"file", options.out}, {"triangles", mesh.indices.size() / 3}};
  context.acknowledge(report, absl::StrCat(options.out, ": ", mesh.indices.size() / 3, " triangles"));
  return absl::OkStatus();
}

absl::Status delete_mesh(const MeshOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  RETURN_IF_ERROR(client->delete_mesh(options.name));
  Report report;
  report.head["deleted"] = options.name;
  context.acknowledge(report, absl::StrCat("deleted ", options.name));
  return absl::OkStatus();
}

// Adds a subcommand whose argument is the name of one mesh.
template <class Run>
CLI::App& add_one(CLI::App& parent, Context& context, const std::string& name, const std::string& description,
                  const std::shared_ptr<MeshOptions>& options, Run run) {
  CLI::App& command = *parent.add_subcommand(name, description);
  command.add_option("NAME", options->name, "The mesh")->required();
  run_when_chosen(command, options, context, run);
  return command;
}

}  // namespace

void add_mesh_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("mesh", "List, show, download and delete uploaded meshes");
  command.footer(
      "Examples:\n  locus mesh list\n  locus mesh download city-5000-1 --out city.obj\n  locus mesh delete "
      "city-5000-1");
  command.require_subcommand(1);
  const auto options = std::make_shared<MeshOptions>();
  CLI::App& lister = *command.add_subcommand("list", "List the meshes of the server, which all scenes share");
  lister.footer("Examples:\n  locus mesh list\n  locus -o ndjson mesh list");
  run_when_chosen(lister, options, context, list_meshes);
  add_one(command, context, "show", "Show a mesh and its parts", options, show)
      .footer("Examples:\n  locus mesh show city-5000-1\n  locus -o json mesh show city-5000-1");
  CLI::App& downloader = add_one(command, context, "download", "Write a mesh to an OBJ file", options, download);
  downloader.footer("Examples:\n  locus mesh download city-5000-1 --out city.obj");
  downloader.add_option("--out", options->out, "The file")->required()->type_name("FILE");
  add_one(command, context, "delete", "Delete a mesh that no scene uses", options, delete_mesh)
      .footer("Examples:\n  locus mesh delete city-5000-1");
}

}  // namespace locus::cli
