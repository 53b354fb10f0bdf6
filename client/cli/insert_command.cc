#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/update_report.h"
#include "client/lib/update_builder.h"

namespace locus::cli {
namespace {

struct InsertOptions {
  std::string scene;
  std::string shape;
  std::vector<Number64> ids;
  std::vector<Triple> at;
  std::vector<double> radii;
  std::vector<Triple> half_extents;
  std::vector<Triple> half_axes;
  std::vector<Quaternion> rotations;
  std::vector<Number64> layers;
  std::vector<Number64> groups;
  std::vector<Number64> tags;
  std::optional<uint64_t> tick;
  bool upsert = false;
};

// Which measures a shape has; the parser knows them only as optional.
absl::Status check_measures(const InsertOptions& options) {
  struct Measure {
    const char* name;
    bool given;
    bool needed;
  };
  const bool capsule = options.shape == "capsule";
  for (const Measure& measure : {Measure{"--radius", !options.radii.empty(), capsule || options.shape == "ball"},
                                 Measure{"--half", !options.half_extents.empty(), options.shape == "box"},
                                 Measure{"--axis", !options.half_axes.empty(), capsule}}) {
    if (measure.needed && !measure.given)
      return usage_error(absl::StrCat("a ", options.shape, " needs ", measure.name));
    if (measure.given && !measure.needed)
      return usage_error(absl::StrCat("a ", options.shape, " has no ", measure.name));
  }
  return absl::OkStatus();
}

v1::UpdateBatch batch_of(const InsertOptions& options) {
  const std::vector<uint64_t> ids = values_of(options.ids);
  const std::vector<double> positions = doubles_of(options.at);
  const std::vector<float> rotations = floats_of(options.rotations);
  const std::vector<uint32_t> layers = values32_of(options.layers);
  const std::vector<uint64_t> groups = values_of(options.groups);
  const std::vector<uint64_t> tags = values_of(options.tags);
  const client::InsertColumns columns = {
      .ids = ids, .positions_f64 = positions, .rotations = rotations, .layers = layers, .groups = groups, .tags = tags};
  client::UpdateBuilder builder;
  if (options.upsert) builder.upsert();
  if (options.tick) builder.tick(*options.tick);
  if (options.shape == "point") {
    builder.insert_points(columns);
  } else if (options.shape == "ball") {
    builder.insert_balls(columns, floats_of(options.radii));
  } else if (options.shape == "box") {
    builder.insert_boxes(columns, floats_of(options.half_extents));
  } else {
    builder.insert_capsules(columns, floats_of(options.half_axes), floats_of(options.radii));
  }
  return builder.build();
}

absl::Status insert(const InsertOptions& options, Context& context) {
  const absl::Status checked = check_measures(options);
  if (!checked.ok()) return checked;
  return apply_and_report(options.scene, batch_of(options), context);
}

}  // namespace

void add_insert_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<InsertOptions>();
  CLI::App& command = *parent.add_subcommand("insert", "Insert objects: points, balls, boxes or capsules");
  command.footer(R"(Examples:
  locus insert arena ball --id 7 --at 1,2,3 --radius 0.5
  locus insert arena point --id 8 --at 0,0,0 --tag 42
  locus insert arena box --id 9 --at 4,0,0 --half 1,1,2 --rotation 0,0,0.7071068,0.7071068
  locus insert arena capsule --id 10 --at 0,3,0 --axis 0,0.6,0 --radius 0.3 --group 3 --layers 2
  locus insert arena ball --id 1 --at 0,0,0 --id 2 --at 5,0,0 --radius 1)");
  add_scene_argument(command, options->scene);
  command.add_option("SHAPE", options->shape, "point, ball, box or capsule")
      ->required()
      ->check(choices({"point", "ball", "box", "capsule"}));
  add_repeatable(command, "--id", options->ids, "ID", "Its id, not 0; repeat --id and --at for more objects")
      ->required();
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre")->required();
  add_repeatable(command, "--radius", options->radii, "R", "Ball, capsule: its radius, one for each or one for all");
  add_repeatable(command, "--half", options->half_extents, "X,Y,Z", "Box: half its size along its own axes");
  add_repeatable(command, "--axis", options->half_axes, "X,Y,Z",
                 "Capsule: from the centre to one end of the inner segment, in its own axes");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Unit quaternion [0,0,0,1]");
  add_repeatable(command, "--layers", options->layers, "BITS", "What queries' masks look at [1]; 0 hides it")
      ->check(fits_32_bits());
  add_repeatable(command, "--group", options->groups, "GROUP", "What it is part of [0: nothing]");
  add_repeatable(command, "--tag", options->tags, "TAG", "A number of your own [0]");
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--upsert", options->upsert, "Replace an object that has the id");
  run_when_chosen(command, options, context, insert);
}

}  // namespace locus::cli
