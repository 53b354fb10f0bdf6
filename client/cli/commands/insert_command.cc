#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_update.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/part_list.h"
#include "client/cli/rows/update_report.h"
#include "client/lib/update_builder.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct InsertOptions {
  std::string scene;
  BulkOptions bulk;
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
  std::vector<std::string> parts;  // JSON lists; one for all objects
  std::vector<Number64> expire_ticks;
  std::optional<uint64_t> tick;
  bool upsert = false;
};

// Returns a usage error unless exactly the options that the shape needs are given: --radius for a ball or capsule,
// --half for a box, --axis for a capsule, --parts for a compound. The parser cannot check this, because each of these
// options is optional to the parser.
absl::Status check_measures(const InsertOptions& options) {
  struct Measure {
    const char* name;
    bool given;
    bool needed;
  };
  const bool capsule = options.shape == "capsule";
  for (const Measure& measure : {Measure{"--radius", !options.radii.empty(), capsule || options.shape == "ball"},
                                 Measure{"--half", !options.half_extents.empty(), options.shape == "box"},
                                 Measure{"--axis", !options.half_axes.empty(), capsule},
                                 Measure{"--parts", !options.parts.empty(), options.shape == "compound"}}) {
    if (measure.needed && !measure.given)
      return usage_error(absl::StrCat("a ", options.shape, " needs ", measure.name));
    if (measure.given && !measure.needed)
      return usage_error(absl::StrCat("a ", options.shape, " has no ", measure.name));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::UpdateBatch> batch_of(const InsertOptions& options) {
  const std::vector<uint64_t> ids = values_of(options.ids);
  const std::vector<double> positions = doubles_of(options.at);
  const std::vector<float> rotations = floats_of(options.rotations);
  const std::vector<uint32_t> layers = values32_of(options.layers);
  const std::vector<uint64_t> groups = values_of(options.groups);
  const std::vector<uint64_t> tags = values_of(options.tags);
  const std::vector<uint64_t> expire_ticks = values_of(options.expire_ticks);
  const client::InsertColumns columns = {.ids = ids,
                                         .positions_f64 = positions,
                                         .rotations = rotations,
                                         .layers = layers,
                                         .groups = groups,
                                         .tags = tags,
                                         .expire_ticks = expire_ticks};
  client::UpdateBuilder builder;
  if (options.upsert) builder.upsert();
  if (options.tick) builder.tick(*options.tick);
  if (options.shape == "point") {
    builder.insert_points(columns);
  } else if (options.shape == "ball") {
    builder.insert_balls(columns, floats_of(options.radii));
  } else if (options.shape == "box") {
    builder.insert_boxes(columns, floats_of(options.half_extents));
  } else if (options.shape == "compound") {
    ASSIGN_OR_RETURN(const client::Compound compound, read_parts(options.parts.front()));
    builder.insert_compounds(columns, compound);
  } else {
    builder.insert_capsules(columns, floats_of(options.half_axes), floats_of(options.radii));
  }
  return builder.build();
}

// Indices of the fields in the schema of bulk rows.
enum InsertField : size_t {
  kId,
  kAt,
  kRadius,
  kHalf,
  kAxis,
  kRotation,
  kLayers,
  kGroup,
  kTag,
  kParts,
  kExpire,
  kShape
};

const std::vector<std::string>& shapes() {
  static const auto& shapes = *new std::vector<std::string>{"point", "ball", "box", "capsule", "compound"};
  return shapes;
}

RowSchema schema_of(const InsertOptions& options) {
  Field at = {.name = "at", .kind = FieldKind::kCoordinate, .parts = "xyz", .aliases = {"position"}, .required = true};
  Field half = {.name = "half", .parts = "xyz", .aliases = {"half_extents"}};
  Field axis = {.name = "axis", .parts = "xyz", .aliases = {"half_axis"}};
  Field shape = {.name = "shape", .kind = FieldKind::kWord, .required = options.shape == "mixed", .words = shapes()};
  return {{.name = "id", .kind = FieldKind::kId, .required = true},
          at,
          column_or_option({.name = "radius"}, options.radii, "--radius"),
          column_or_option(half, options.half_extents, "--half"),
          column_or_option(axis, options.half_axes, "--axis"),
          column_or_option({.name = "rotation", .parts = "xyzw"}, options.rotations, "--rotation"),
          column_or_option({.name = "layers", .kind = FieldKind::kBits}, options.layers, "--layers"),
          column_or_option({.name = "group", .kind = FieldKind::kId}, options.groups, "--group"),
          column_or_option({.name = "tag", .kind = FieldKind::kId}, options.tags, "--tag"),
          column_or_option({.name = "parts", .kind = FieldKind::kJson}, options.parts, "--parts"),
          column_or_option({.name = "expire_ticks", .kind = FieldKind::kId}, options.expire_ticks, "--expire-ticks"),
          shape};
}

const std::string& shape_of(const InsertOptions& options, const RowBatch& batch, size_t row) {
  return options.shape == "mixed" ? shapes()[batch.columns[kShape].integers[row]] : options.shape;
}

absl::Status check_row(const InsertOptions& options, const RowBatch& batch, size_t row) {
  const std::string& shape = shape_of(options, batch, row);
  const RowColumn& named = batch.columns[kShape];
  if (named.given[row] != 0 && shapes()[named.integers[row]] != shape) {
    return absl::InvalidArgumentError(absl::StrCat("shape: is ", shapes()[named.integers[row]],
                                                   ", and the command says ", shape, "; `mixed` takes every shape"));
  }
  struct Measure {
    InsertField field;
    const char* name;
    bool needed;
    bool by_option;
  };
  const bool capsule = shape == "capsule";
  for (const Measure& measure : {Measure{kRadius, "radius", capsule || shape == "ball", !options.radii.empty()},
                                 Measure{kHalf, "half", shape == "box", !options.half_extents.empty()},
                                 Measure{kAxis, "axis", capsule, !options.half_axes.empty()},
                                 Measure{kParts, "parts", shape == "compound", !options.parts.empty()}}) {
    const bool given = batch.columns[measure.field].given[row] != 0;
    if (given && !measure.needed)
      return absl::InvalidArgumentError(absl::StrCat("a ", shape, " has no ", measure.name));
    if (!given && measure.needed && !measure.by_option) {
      return absl::InvalidArgumentError(absl::StrCat(measure.name, ": is missing; a ", shape, " needs it"));
    }
  }
  if (batch.columns[kParts].given[row] != 0) return read_parts(batch.columns[kParts].texts[row]).status();
  return absl::OkStatus();
}

// Returns whether two rows may share an Insert message: they have the same shape and, for compounds, the same parts,
// and both or none have layers.
bool share_insert(const InsertOptions& options, const RowBatch& batch, size_t a, size_t b) {
  const std::string& shape = shape_of(options, batch, a);
  if (shape_of(options, batch, b) != shape) return false;
  const std::vector<uint8_t>& has_layers = batch.columns[kLayers].given;
  const std::vector<std::string>& parts = batch.columns[kParts].texts;
  return shape != "compound" || (has_layers[a] == has_layers[b] && parts[a] == parts[b]);
}

// Adds the rows `rows` of `batch`, which share an Insert message, to the update.
void add_rows(const InsertOptions& options, const RowBatch& batch, RowSpan rows, client::UpdateBuilder& builder) {
  const std::vector<RowColumn>& columns = batch.columns;
  const std::vector<uint64_t> ids = id_column(columns[kId], rows, 0, {});
  const std::vector<double> positions = positions_of(columns[kAt], rows);
  const std::vector<float> rotations =
      float_column(columns[kRotation], rows, {0, 0, 0, 1}, floats_of(options.rotations));
  std::vector<uint32_t> layers = bits_column(columns[kLayers], rows, 1, values32_of(options.layers));
  // Without layers, a compound is in all layers of its parts.
  if (shape_of(options, batch, rows.begin) == "compound" && options.layers.empty() &&
      columns[kLayers].given[rows.begin] == 0) {
    layers.clear();
  }
  const std::vector<uint64_t> groups = id_column(columns[kGroup], rows, 0, values_of(options.groups));
  const std::vector<uint64_t> tags = id_column(columns[kTag], rows, 0, values_of(options.tags));
  const std::vector<uint64_t> expire_ticks = id_column(columns[kExpire], rows, 0, values_of(options.expire_ticks));
  const client::InsertColumns common = {.ids = ids,
                                        .positions_f64 = positions,
                                        .rotations = rotations,
                                        .layers = layers,
                                        .groups = groups,
                                        .tags = tags,
                                        .expire_ticks = expire_ticks};
  const std::vector<float> radii = float_column(columns[kRadius], rows, {0}, floats_of(options.radii));
  const std::string& shape = shape_of(options, batch, rows.begin);
  if (shape == "point") {
    builder.insert_points(common);
  } else if (shape == "ball") {
    builder.insert_balls(common, radii);
  } else if (shape == "box") {
    builder.insert_boxes(common, float_column(columns[kHalf], rows, {0, 0, 0}, floats_of(options.half_extents)));
  } else if (shape == "compound") {
    // check_row() and insert_rows() have checked the parts.
    builder.insert_compounds(
        common, *read_parts(options.parts.empty() ? columns[kParts].texts[rows.begin] : options.parts.front()));
  } else {
    builder.insert_capsules(common, float_column(columns[kAxis], rows, {0, 0, 0}, floats_of(options.half_axes)), radii);
  }
}

v1::UpdateBatch batch_of_rows(const InsertOptions& options, const RowBatch& batch) {
  client::UpdateBuilder builder;
  if (options.upsert) builder.upsert();
  if (options.tick) builder.tick(*options.tick);
  for (size_t begin = 0, end = 0; begin < batch.rows(); begin = end) {
    end = begin + 1;
    while (end < batch.rows() && share_insert(options, batch, begin, end)) ++end;
    add_rows(options, batch, {begin, end}, builder);
  }
  return builder.build();
}

absl::Status insert_rows(const InsertOptions& options, Context& context) {
  absl::Status checked = check(options.bulk);
  if (checked.ok() && !(options.ids.empty() && options.at.empty())) {
    checked = usage_error("give --id and --at or an input with their columns, not both");
  }
  checked.Update(at_most_one(options.radii, "--radius"));
  checked.Update(at_most_one(options.half_extents, "--half"));
  checked.Update(at_most_one(options.half_axes, "--axis"));
  checked.Update(at_most_one(options.rotations, "--rotation"));
  checked.Update(at_most_one(options.layers, "--layers"));
  checked.Update(at_most_one(options.groups, "--group"));
  checked.Update(at_most_one(options.tags, "--tag"));
  checked.Update(at_most_one(options.parts, "--parts"));
  checked.Update(at_most_one(options.expire_ticks, "--expire-ticks"));
  if (checked.ok() && !options.parts.empty()) checked = read_parts(options.parts.front()).status();
  RETURN_IF_ERROR(checked);
  const BulkUpdate update = {
      .schema = schema_of(options),
      .check_row = [&](const RowBatch& batch, size_t row) { return check_row(options, batch, row); },
      .batch_of = [&](const RowBatch& batch) { return batch_of_rows(options, batch); }};
  return run_bulk_update(update, options.scene, options.bulk, context);
}

absl::Status insert(const InsertOptions& options, Context& context) {
  if (options.bulk.given()) return insert_rows(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.shape == "mixed") return usage_error("mixed shapes come from --from-csv or --from-ndjson");
  if (options.ids.empty() || options.at.empty()) {
    return usage_error("give --id and --at, or rows with --from-csv or --from-ndjson");
  }
  RETURN_IF_ERROR(check_measures(options));
  if (options.parts.size() > 1) return usage_error("all objects of a command have the same --parts: give them once");
  ASSIGN_OR_RETURN(const v1::UpdateBatch batch, batch_of(options));
  return apply_and_report(options.scene, batch, context);
}

}  // namespace

void add_insert_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<InsertOptions>();
  CLI::App& command = *parent.add_subcommand("insert", "Insert objects: points, balls, boxes, capsules or compounds");
  command.footer(R"(Examples:
  locus insert arena ball --id 7 --at 1,2,3 --radius 0.5
  locus insert arena point --id 8 --at 0,0,0 --tag 42
  locus insert arena box --id 9 --at 4,0,0 --half 1,1,2 --rotation 0,0,0.7071068,0.7071068
  locus insert arena capsule --id 10 --at 0,3,0 --axis 0,0.6,0 --radius 0.3 --group 3 --layers 2
  locus insert arena ball --id 1 --at 0,0,0 --id 2 --at 5,0,0 --radius 1
  locus insert arena ball --from-csv balls.csv --radius 0.5
  locus insert arena ball --id 3 --at 0,0,5 --radius 0.1 --expire-ticks 600
  locus insert arena compound --id 11 --at 0,6,0 --parts '[{"ball":0.12,"at":[0,0,1.7],"layers":2},
    {"capsule":{"axis":[0,0,0.3],"radius":0.25},"at":[0,0,1.1]},{"box":[0.3,0.2,0.4],"at":[0,0,0.4]}]'
  generator | locus insert arena mixed --from-ndjson - --upsert
  locus insert arena mixed --from-csv level.csv --one-revision
  tracker | locus insert arena ball --from-ndjson - --radius 0.5 --upsert --lease 5

Rows: id,at.x,at.y,at.z[,radius,half.x ..,axis.x ..,rotation.x ..,layers,group,tag,expire_ticks,parts] or
{"id": "7", "at": [1,2,3]}; parts is a list in JSON; mixed rows have a column shape; an option given once stands for a column. Each batch is one revision.)");
  add_scene_argument(command, options->scene);
  command.add_option("SHAPE", options->shape, "point, ball, box, capsule, compound; mixed: by row")
      ->required()
      ->check(choices({"point", "ball", "box", "capsule", "compound", "mixed"}));
  add_repeatable(command, "--id", options->ids, "ID", "Its id, not 0; repeat --id and --at for more objects");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre");
  add_repeatable(command, "--radius", options->radii, "R", "Ball, capsule: its radius, one for each or one for all");
  add_repeatable(command, "--half", options->half_extents, "X,Y,Z", "Box: half its size along its own axes");
  add_repeatable(command, "--axis", options->half_axes, "X,Y,Z",
                 "Capsule: from the centre to one end of the inner segment, in its own axes");
  add_repeatable(
      command, "--parts", options->parts, "JSON",
      "Compound: a list of its parts, each ball, box or capsule with at, and rotation and layers [none, all]");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Unit quaternion [0,0,0,1]");
  add_repeatable(command, "--layers", options->layers, "BITS",
                 "Layer bits, matched with the masks of queries [1, or those of the parts]; 0 hides it")
      ->check(fits_32_bits());
  add_repeatable(command, "--group", options->groups, "GROUP", "Its group [0: none]");
  add_repeatable(command, "--tag", options->tags, "TAG", "A number of your own [0]");
  add_repeatable(command, "--expire-ticks", options->expire_ticks, "TICKS",
                 "Number of ticks after which it is removed [0: never]");
  add_bulk_update_options(command, options->bulk);
  command
      .add_option(
          "--lease", options->bulk.lease_seconds,
          "With an input: remove the objects when it has ended, or this command is cut off, for so long [never]")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.001, limits::kMaxLeaseMs / 1000.0).description(""));
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--upsert", options->upsert, "Replace an object that has the id");
  run_or_check_when_chosen(command, options, context, insert);
}

}  // namespace locus::cli
