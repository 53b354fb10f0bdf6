#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/generate/city.h"
#include "client/cli/mesh_placement.h"
#include "client/cli/obj_file.h"

namespace locus::cli {
namespace {

struct CityOptions {
  uint64_t triangles = 100'000;
  uint64_t seed = 1;
  std::string out;
  PlacementOptions placement;
};

absl::Status write_city(const std::string& path, const ImportedMesh& city, Context& context) {
  std::ofstream file(path, std::ios::trunc);
  write_obj(file, city);
  file.close();
  if (!file) return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder and space"));
  Report report;
  report.head = {{"file", path}, {"triangles", city.indices.size() / 3}};
  context.write(report);
  return absl::OkStatus();
}

absl::Status generate_city_command(CityOptions options, Context& context) {
  if (options.out.empty() && options.placement.scene.empty()) options.placement.scene = context.default_scene();
  if (options.placement.scene.empty() == options.out.empty()) return usage_error("give either --scene or --out");
  ImportedMesh city = generate_city(options.triangles, options.seed);
  if (!options.out.empty()) return write_city(options.out, city, context);
  if (options.placement.mesh.empty()) city.name = absl::StrCat("city-", options.triangles, "-", options.seed);
  ImportedLevel level;
  level.meshes.push_back(std::move(city));
  return upload_and_place(options.placement, level, context);
}

void add_city(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<CityOptions>();
  CLI::App& command = *parent.add_subcommand("city", "A made-up city of boxes, the same for the same seed");
  command.footer(R"(Examples:
  locus generate city --triangles 100000 --seed 1 --scene arena --create
  locus generate city --triangles 5000 --seed 7 --out city.obj)");
  command.add_option("--triangles", options->triangles, "At most so many [100000]")
      ->type_name("N")
      ->check(CLI::Range(uint64_t{12}, kMaxCityTriangles).description(""));
  command.add_option("--seed", options->seed, "Which city [1]")->type_name("N");
  command.add_option("--scene", options->placement.scene, "Upload it and place it in this scene")->type_name("SCENE");
  command.add_option("--out", options->out, "Write it to this OBJ file instead")->type_name("FILE");
  add_placement_options(command, options->placement);
  run_when_chosen(command, options, context, generate_city_command);
}

}  // namespace

void add_generate_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("generate", "Make up a level, for trying the server without one");
  command.footer("Examples:\n  locus generate city --triangles 100000 --seed 1 --scene arena --create");
  command.require_subcommand(1);
  add_city(command, context);
}

}  // namespace locus::cli
