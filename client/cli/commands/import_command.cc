#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/commands/mesh_placement.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct ImportCommandOptions {
  std::string file;
  ImportOptions import;
  PlacementOptions placement;
};

absl::Status import(const ImportCommandOptions& options, Context& context) {
  ProgressWriter progress = start_progress(context);
  progress.begin({.action = "reading", .subject = options.file});
  ASSIGN_OR_RETURN(const ImportedLevel level, import_file(options.file, options.import));
  progress.hide();
  for (const std::string& note : level.notes) context.err() << "note: " << note << '\n';
  if (!level.filtered)
    context.err() << "note: this kernel took no filter of system calls; only limits of memory, time and open files "
                     "confined the process that read the file\n";
  return upload_and_place(options.placement, level, context, progress);
}

}  // namespace

void add_import_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ImportCommandOptions>();
  options->placement.scene = context.default_scene();
  CLI::App& command =
      *parent.add_subcommand("import",
                             "Upload a level from a file and place it in a scene: OBJ, PLY, STL, glTF, GLB, "
                             "BSP (Quake 3), PK3");
  command.footer(R"(Examples:
  locus import level.glb --scene arena --create
  locus import pak1-maps.pk3 --entry maps/oa_dm1.bsp --scene arena --scale 0.0254
  locus import house.obj --scene arena --mesh house --at 100,0,0 --layers 2 --up y)");
  command.add_option("FILE", options->file, "The file")->required();
  command.add_option("--scene", options->placement.scene, "The scene to place it in")
      ->required(context.default_scene().empty())
      ->type_name("SCENE");
  command.add_option("--entry", options->import.entry, "The level inside a PK3 [the first]")->type_name("PATH");
  command.add_option("--scale", options->import.scale, "Multiplies every coordinate [1]")->type_name("FACTOR");
  command
      .add_option("--patch-subdivisions", options->import.patch_subdivisions,
                  "Quake 3: this many squared quads for each curved patch [6]")
      ->type_name("N");
  add_up_option(
      command, options->placement.up,
      "Axis that points up in the file: y, z; with --create kept as the scene's label up [y for glTF and GLB, "
      "else z]");
  add_placement_options(command, options->placement);
  run_when_chosen(command, options, context, import);
}

}  // namespace locus::cli
