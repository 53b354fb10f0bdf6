#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_update.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/part_list.h"
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
  std::vector<std::string> parts;  // JSON lists of poses; one for all objects
  std::optional<uint64_t> tick;
  bool teleport = false;
};

client::MoveKind kind_of(const MoveOptions& options) {
  return options.teleport ? client::MoveKind::kTeleport : client::MoveKind::kContinuous;
}

client::MoveColumns columns_of(const std::vector<uint64_t>& ids, const std::vector<double>& positions,
                               const std::vector<float>& rotations, const PoseColumns& poses) {
  return {.ids = ids,
          .positions_f64 = positions,
          .rotations = rotations,
          .parts_each = poses.parts_each,
          .part_positions = poses.positions,
          .part_rotations = poses.rotations};
}

// Indices of the fields in the schema of bulk rows.
enum MoveField : size_t { kMoveId, kMoveTo, kMoveRotation, kMoveParts };

// Returns the update for the rows of `batch`. Rows with a rotation and rows without one go to different Move messages,
// since a Move message has rotations either for all of its objects or for none. Rows share a Move message only if the
// poses of their parts are the same, too. check_row() has checked the poses.
v1::UpdateBatch batch_of_rows(const MoveOptions& options, const RowBatch& batch) {
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  const std::vector<uint8_t>& has_rotation = batch.columns[kMoveRotation].given;
  const std::vector<std::string>& parts = batch.columns[kMoveParts].texts;
  for (size_t begin = 0, end = 0; begin < batch.rows(); begin = end) {
    end = begin + 1;
    while (end < batch.rows() && has_rotation[end] == has_rotation[begin] && parts[end] == parts[begin]) {
      ++end;
    }
    const RowSpan rows = {begin, end};
    const std::vector<uint64_t> ids = id_column(batch.columns[kMoveId], rows, 0, {});
    const std::vector<double> positions = positions_of(batch.columns[kMoveTo], rows);
    std::vector<float> rotations = floats_of(options.rotations);
    if (has_rotation[begin] != 0) rotations = float_column(batch.columns[kMoveRotation], rows, {0, 0, 0, 1}, {});
    PoseColumns poses;
    const std::string& text = options.parts.empty() ? parts[begin] : options.parts.front();
    if (!text.empty()) poses = *read_poses(text);
    builder.moves(columns_of(ids, positions, rotations, poses), kind_of(options));
  }
  return builder.build();
}

absl::Status move_rows(const MoveOptions& options, Context& context) {
  absl::Status checked = check(options.bulk);
  if (checked.ok() && !(options.ids.empty() && options.to.empty())) {
    checked = usage_error("give --id and --to or an input with their columns, not both");
  }
  checked.Update(at_most_one(options.rotations, "--rotation"));
  checked.Update(at_most_one(options.parts, "--parts"));
  if (checked.ok() && !options.parts.empty()) checked = read_poses(options.parts.front()).status();
  RETURN_IF_ERROR(checked);
  const BulkUpdate update = {
      .schema = {{.name = "id", .kind = FieldKind::kId, .required = true},
                 {.name = "to",
                  .kind = FieldKind::kCoordinate,
                  .parts = "xyz",
                  .aliases = {"at", "position"},
                  .required = true},
                 column_or_option({.name = "rotation", .parts = "xyzw"}, options.rotations, "--rotation"),
                 column_or_option({.name = "parts", .kind = FieldKind::kJson}, options.parts, "--parts")},
      .check_row =
          [](const RowBatch& batch, size_t row) {
            const RowColumn& parts = batch.columns[kMoveParts];
            return parts.given[row] != 0 ? read_poses(parts.texts[row]).status() : absl::OkStatus();
          },
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
  if (options.parts.size() > 1) return usage_error("all objects of a command have the same --parts: give them once");
  PoseColumns poses;
  if (!options.parts.empty()) {
    ASSIGN_OR_RETURN(poses, read_poses(options.parts.front()));
  }
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  builder.moves(columns_of(ids, positions, rotations, poses), kind_of(options));
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
  locus move arena --id 11 --to 0,7,0 --parts '[{"at":[0,0,1.6]},{"at":[0,0,1.1]},{"at":[0,0,0.4]}]'
  generator | locus move arena --from-ndjson -

Rows: id,to.x,to.y,to.z[,rotation.x,rotation.y,rotation.z,rotation.w,parts] or {"id": "7", "to": [1,2,4]}; parts is a
list in JSON. Each batch is one revision, and ends when it is full or the input pauses.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object; repeat --id and --to for more");
  add_repeatable(command, "--to", options->to, "X,Y,Z", "Its new centre");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Its new rotation [kept]");
  add_repeatable(command, "--parts", options->parts, "JSON",
                 "Compound: new poses of all its parts, a list of at, rotation or both [kept]");
  add_bulk_update_options(command, options->bulk);
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--teleport", options->teleport, "It jumped: queries about the past do not interpolate this move");
  run_or_check_when_chosen(command, options, context, move);
}

}  // namespace locus::cli
