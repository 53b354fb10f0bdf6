#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/update_report.h"
#include "client/lib/update_builder.h"

namespace locus::cli {
namespace {

struct MoveOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::vector<Triple> to;
  std::vector<Quaternion> rotations;
  std::optional<uint64_t> tick;
  bool teleport = false;
};

absl::Status move(const MoveOptions& options, Context& context) {
  const std::vector<uint64_t> ids = values_of(options.ids);
  const std::vector<double> positions = doubles_of(options.to);
  const std::vector<float> rotations = floats_of(options.rotations);
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  builder.moves({.ids = ids, .positions_f64 = positions, .rotations = rotations},
                options.teleport ? client::MoveKind::kTeleport : client::MoveKind::kContinuous);
  return apply_and_report(options.scene, builder.build(), context);
}

}  // namespace

void add_move_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<MoveOptions>();
  CLI::App& command = *parent.add_subcommand("move", "Move objects");
  command.footer(R"(Examples:
  locus move arena --id 7 --to 1,2,4
  locus move arena --id 7 --to 1,2,4 --id 8 --to 0,0,1 --tick 120
  locus move arena --id 9 --to 4,0,0 --rotation 0,0,0,1 --teleport)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object; repeat --id and --to for more")->required();
  add_repeatable(command, "--to", options->to, "X,Y,Z", "Its new centre")->required();
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Its new rotation [kept]");
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--teleport", options->teleport, "It jumped: it was never in between");
  run_when_chosen(command, options, context, move);
}

}  // namespace locus::cli
