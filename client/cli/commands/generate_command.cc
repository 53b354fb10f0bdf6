#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/commands/mesh_placement.h"
#include "client/cli/failure.h"
#include "client/cli/levels/generate/blob.h"
#include "client/cli/levels/generate/city.h"
#include "client/cli/levels/generate/terrain.h"
#include "client/cli/levels/obj_file.h"
#include "client/cli/progress.h"

namespace locus::cli {
namespace {

// Kind of level that can be generated.
struct Kind {
  std::string name;
  std::string description;
  std::string seed_help;
  ImportedMesh (*generate)(uint64_t triangles, uint64_t seed);
  uint64_t min_triangles;
  uint64_t max_triangles;
};

struct GenerateOptions {
  Kind kind;
  uint64_t triangles = 100'000;
  uint64_t seed = 1;
  std::string out;
  PlacementOptions placement;
};

absl::Status write_file(const std::string& path, const ImportedMesh& mesh, Context& context, ProgressWriter& progress) {
  progress.begin({.action = "writing", .subject = path});
  std::ofstream file(path, std::ios::trunc);
  write_obj(file, mesh);
  file.close();
  progress.hide();
  if (!file) return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder and space"));
  Report report;
  report.head = {{"file", path}, {"triangles", mesh.indices.size() / 3}};
  context.acknowledge(report, absl::StrCat(path, ": ", mesh.indices.size() / 3, " triangles"));
  return absl::OkStatus();
}

absl::Status generate(GenerateOptions options, Context& context) {
  if (options.out.empty() && options.placement.scene.empty()) options.placement.scene = context.default_scene();
  if (options.placement.scene.empty() == options.out.empty()) return usage_error("give either --scene or --out");
  ProgressWriter progress = start_progress(context);
  progress.begin({.action = "generating", .subject = options.kind.name});
  ImportedMesh mesh = options.kind.generate(options.triangles, options.seed);
  if (!options.out.empty()) return write_file(options.out, mesh, context, progress);
  if (options.placement.mesh.empty())
    mesh.name = absl::StrCat(options.kind.name, "-", options.triangles, "-", options.seed);
  ImportedLevel level;
  level.meshes.push_back(std::move(mesh));
  return upload_and_place(options.placement, level, context, progress);
}

void add_kind(CLI::App& parent, Context& context, const Kind& kind) {
  const auto options = std::make_shared<GenerateOptions>();
  options->kind = kind;
  CLI::App& command = *parent.add_subcommand(kind.name, kind.description);
  command.footer(absl::StrCat("Examples:\n  locus generate ", kind.name,
                              " --triangles 100000 --seed 1 --scene arena --create\n  locus generate ", kind.name,
                              " --triangles 5000 --seed 7 --out ", kind.name, ".obj"));
  command.add_option("--triangles", options->triangles, "Maximum number of triangles [100000]")
      ->type_name("N")
      ->check(CLI::Range(kind.min_triangles, kind.max_triangles).description(""));
  command.add_option("--seed", options->seed, kind.seed_help)->type_name("N");
  command.add_option("--scene", options->placement.scene, "Upload it and place it in this scene")->type_name("SCENE");
  command.add_option("--out", options->out, "Write it to this OBJ file instead")->type_name("FILE");
  add_placement_options(command, options->placement);
  run_when_chosen(command, options, context, generate);
}

}  // namespace

void add_generate_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("generate", "Make up a level, for trying the server without one");
  command.footer(R"(Examples:
  locus generate city --triangles 100000 --seed 1 --scene arena --create
  locus generate terrain --triangles 1000000 --scene arena --at 0,0,-60
  locus generate blob --triangles 20000 --out blob.obj)");
  command.require_subcommand(1);
  add_kind(command, context,
           {"city", "A made-up city of boxes, the same for the same seed", "Which city [1]", generate_city,
            kMinCityTriangles, kMaxCityTriangles});
  add_kind(command, context,
           {"terrain", "Made-up hills of squares of one metre, the same for the same seed", "Which hills [1]",
            generate_terrain, kMinTerrainTriangles, kMaxTerrainTriangles});
  add_kind(command, context,
           {"blob", "A made-up closed body around the origin, 6 to 14 m from it, the same for the same seed",
            "Which body [1]", generate_blob, kMinBlobTriangles, kMaxBlobTriangles});
}

}  // namespace locus::cli
