#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_update.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/update_report.h"
#include "client/lib/update_builder.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct MoveOptions {
  std::string scene;
  BulkOptions bulk;
  std::vector<Number64> ids;
  std::vector<Triple> to;
  std::vector<Quaternion> rotations;
  std::optional<uint64_t> tick;
  bool teleport = false;
};

client::MoveKind kind_of(const MoveOptions& options) {
  return options.teleport ? client::MoveKind::kTeleport : client::MoveKind::kContinuous;
}

// Indices of the fields in the schema of bulk rows.
enum MoveField : size_t { kMoveId, kMoveTo, kMoveRotation };

// Returns the update for the rows of `batch`. Rows with a rotation and rows without one go to different Move messages,
// since a Move message has rotations either for all of its objects or for none.
v1::UpdateBatch batch_of_rows(const MoveOptions& options, const RowBatch& batch) {
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  const std::vector<uint8_t>& has_rotation = batch.columns[kMoveRotation].given;
  for (size_t begin = 0, end = 0; begin < batch.rows(); begin = end) {
    end = begin + 1;
    while (end < batch.rows() && has_rotation[end] == has_rotation[begin]) ++end;
    const RowSpan rows = {begin, end};
    const std::vector<uint64_t> ids = id_column(batch.columns[kMoveId], rows, 0, {});
    const std::vector<double> positions = positions_of(batch.columns[kMoveTo], rows);
    std::vector<float> rotations = floats_of(options.rotations);
    if (has_rotation[begin] != 0) rotations = float_column(batch.columns[kMoveRotation], rows, {0, 0, 0, 1}, {});
    builder.moves({.ids = ids, .positions_f64 = positions, .rotations = rotations}, kind_of(options));
  }
  return builder.build();
}

absl::Status move_rows(const MoveOptions& options, Context& context) {
  absl::Status checked = check(options.bulk);
  if (checked.ok() && !(options.ids.empty() && options.to.empty())) {
    checked = usage_error("give --id and --to or an input with their columns, not both");
  }
  checked.Update(at_most_one(options.rotations, "--rotation"));
  RETURN_IF_ERROR(checked);
  const BulkUpdate update = {
      .schema = {{.name = "id", .kind = FieldKind::kId, .required = true},
                 {.name = "to",
                  .kind = FieldKind::kCoordinate,
                  .parts = "xyz",
                  .aliases = {"at", "position"},
                  .required = true},
                 column_or_option({.name = "rotation", .parts = "xyzw"}, options.rotations, "--rotation")},
      .check_row = {},
      .batch_of = [&](const RowBatch& batch) { return batch_of_rows(options, batch); }};
  return run_bulk_update(update, options.scene, options.bulk, context);
}

absl::Status move(const MoveOptions& options, Context& context) {
  if (options.bulk.given()) return move_rows(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.ids.empty() || options.to.empty()) {
    return usage_error("give --id and --to, or rows with --from-csv or --from-ndjson");
  }
  const std::vector<uint64_t> ids = values_of(options.ids);
  const std::vector<double> positions = doubles_of(options.to);
  const std::vector<float> rotations = floats_of(options.rotations);
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  builder.moves({.ids = ids, .positions_f64 = positions, .rotations = rotations}, kind_of(options));
  return apply_and_report(options.scene, builder.build(), context);
}

}  // namespace

void add_move_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<MoveOptions>();
  CLI::App& command = *parent.add_subcommand("move", "Move objects");
  command.footer(R"(Examples:
  locus move arena --id 7 --to 1,2,4
  locus move arena --id 7 --to 1,2,4 --id 8 --to 0,0,1 --tick 120
  locus move arena --id 9 --to 4,0,0 --rotation 0,0,0,1 --teleport
  generator | locus move arena --from-ndjson -

Rows: id,to.x,to.y,to.z[,rotation.x,rotation.y,rotation.z,rotation.w] or {"id": "7", "to": [1,2,4]}. Each batch is one
revision, and ends when it is full or the input pauses.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object; repeat --id and --to for more");
  add_repeatable(command, "--to", options->to, "X,Y,Z", "Its new centre");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Its new rotation [kept]");
  add_bulk_options(command, options->bulk);
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--teleport", options->teleport, "It jumped: queries about the past do not interpolate this move");
  run_or_check_when_chosen(command, options, context, move);
}

}  // namespace locus::cli
