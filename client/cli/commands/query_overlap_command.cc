#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_query.h"
#include "client/cli/commands/query_command.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct BallOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> at;
  std::vector<double> radii;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

struct BoxOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> at;
  std::vector<Triple> half_extents;
  std::vector<Quaternion> rotations;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

struct CapsuleOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> from;
  std::vector<Triple> to;
  std::vector<double> radii;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

// Indices of the fields in the schemas of bulk rows. kBallFilter and kBoxFilter are each the index of the first field
// that add_filter_fields() appends.
enum BallField : size_t { kBallAt, kBallRadius, kBallFilter };
enum BoxField : size_t { kBoxAt, kBoxHalf, kBoxRotation, kBoxFilter };

template <class Options>
absl::Status check_input(const Options& options) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && !options.at.empty()) checked = usage_error("give --at or an input with its columns, not both");
  return checked;
}

template <class Options>
BulkQuery bulk_query(const Options& options, const char* kind) {
  return {.schema = {at_field()},
          .layout = {.query = kind, .columns = overlap_columns(options.query, options.detail)},
          .rows_name = "found",
          .add_block = {}};
}

absl::Status query_balls_of_input(const BallOptions& options, Context& context) {
  absl::Status checked = check_input(options);
  checked.Update(at_most_one(options.radii, "--radius"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = bulk_query(options, "ball");
  query.schema.push_back(column_or_option({.name = "radius", .required = true}, options.radii, "--radius"));
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    client::BallBlock block = builder.balls();
    apply_to_block(options.query, block);
    block.frame(rows.frame).columns(query.layout.columns).detail(options.detail);
    block.balls(rows.offsets, float_column(rows.batch.columns[kBallRadius], rows.rows, {0}, floats_of(options.radii)));
    apply_filter_columns(options.query, rows, kBallFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_boxes_of_input(const BoxOptions& options, Context& context) {
  absl::Status checked = check_input(options);
  checked.Update(at_most_one(options.half_extents, "--half"));
  checked.Update(at_most_one(options.rotations, "--rotation"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = bulk_query(options, "box");
  query.schema.push_back(column_or_option(
      {.name = "half", .parts = "xyz", .aliases = {"half_extents"}, .required = true}, options.half_extents, "--half"));
  query.schema.push_back(column_or_option({.name = "rotation", .parts = "xyzw"}, options.rotations, "--rotation"));
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    const std::vector<RowColumn>& columns = rows.batch.columns;
    client::BoxBlock block = builder.boxes();
    apply_to_block(options.query, block);
    block.frame(rows.frame).columns(query.layout.columns).detail(options.detail);
    block.boxes(rows.offsets, float_column(columns[kBoxHalf], rows.rows, {0, 0, 0}, floats_of(options.half_extents)));
    block.rotations(float_column(columns[kBoxRotation], rows.rows, {0, 0, 0, 1}, floats_of(options.rotations)));
    apply_filter_columns(options.query, rows, kBoxFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

enum CapsuleField : size_t { kCapsuleFrom, kCapsuleWay, kCapsuleRadius, kCapsuleFilter };

absl::Status query_capsules_of_input(const CapsuleOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && (!options.from.empty() || !options.to.empty()))
    checked = usage_error("give --from and --to or an input with its columns, not both");
  checked.Update(at_most_one(options.radii, "--radius"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = bulk_query(options, "capsule");
  query.schema = {{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                  {.name = "way", .parts = "xyz", .required = true},
                  column_or_option({.name = "radius", .required = true}, options.radii, "--radius")};
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    const std::vector<RowColumn>& columns = rows.batch.columns;
    client::CapsuleBlock block = builder.capsules();
    apply_to_block(options.query, block);
    block.frame(rows.frame).columns(query.layout.columns).detail(options.detail);
    std::vector<float> ends = float_column(columns[kCapsuleWay], rows.rows, {0, 0, 0}, {});
    for (size_t i = 0; i < ends.size(); ++i) ends[i] += rows.offsets[i];
    block.capsules(rows.offsets, ends, float_column(columns[kCapsuleRadius], rows.rows, {0}, floats_of(options.radii)));
    apply_filter_columns(options.query, rows, kCapsuleFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_ball(const BallOptions& options, Context& context) {
  if (options.bulk.given()) return query_balls_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.at.empty() || options.radii.empty()) {
    return usage_error("give --at and --radius, or rows with --from-csv or --from-ndjson");
  }
  const FramedPositions at = framed(options.at);
  const RowLayout layout = {
      .query = "ball", .columns = overlap_columns(options.query, options.detail), .frame = at.frame};
  client::QueryBuilder builder;
  client::BallBlock block = builder.balls();
  block.frame(at.frame).columns(layout.columns).detail(options.detail);
  block.balls(at.offsets, floats_of(options.radii));
  apply_to_block(options.query, block);
  return ask_and_report(options.query, builder, layout, "found", context);
}

absl::Status query_box(const BoxOptions& options, Context& context) {
  if (options.bulk.given()) return query_boxes_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.at.empty() || options.half_extents.empty()) {
    return usage_error("give --at and --half, or rows with --from-csv or --from-ndjson");
  }
  const FramedPositions at = framed(options.at);
  const RowLayout layout = {
      .query = "box", .columns = overlap_columns(options.query, options.detail), .frame = at.frame};
  client::QueryBuilder builder;
  client::BoxBlock block = builder.boxes();
  block.frame(at.frame).columns(layout.columns).detail(options.detail);
  block.boxes(at.offsets, floats_of(options.half_extents)).rotations(floats_of(options.rotations));
  apply_to_block(options.query, block);
  return ask_and_report(options.query, builder, layout, "found", context);
}

// Queries capsules. Without bulk input, both ends of all capsules are sent as offsets from one frame.
absl::Status query_capsule(const CapsuleOptions& options, Context& context) {
  if (options.bulk.given()) return query_capsules_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.from.empty() || options.to.empty() || options.radii.empty())
    return usage_error("give --from, --to and --radius, or rows with --from-csv or --from-ndjson");
  const FramedPaths at = framed(options.from, options.to);
  const RowLayout layout = {
      .query = "capsule", .columns = overlap_columns(options.query, options.detail), .frame = at.frame};
  client::QueryBuilder builder;
  client::CapsuleBlock block = builder.capsules();
  block.frame(at.frame).columns(layout.columns).detail(options.detail);
  block.capsules(at.starts, at.ends, floats_of(options.radii));
  apply_to_block(options.query, block);
  return ask_and_report(options.query, builder, layout, "found", context);
}

// Adds the options of an overlap query: --detail, --after-id, the options for bulk input, and the options that all
// queries have.
template <class Options>
void add_overlap_options(CLI::App& command, Options& options) {
  add_detail_option(command, options.detail);
  add_after_id_option(command, options.query);
  add_bulk_query_options(command, options.bulk);
  add_query_options(command, options.query);
}

}  // namespace

void add_query_ball(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BallOptions>();
  CLI::App& command = *parent.add_subcommand("ball", "Ask what balls touch");
  command.footer(R"(Examples:
  locus query ball arena --at 0,0,0 --radius 10
  locus query ball arena --at 0,0,0 --at 50,0,0 --radius 2.5 --source dynamic --columns group,tag
  locus query ball arena --at 1,2,3 --radius 0 --detail triangles
  locus query ball arena --at 0,0,0 --anchor 7 --radius 10 --count-only
  locus -o csv query ball arena --from-csv balls.csv > found.csv

Rows: at.x,at.y,at.z,radius[,mask,ignore_group] or {"at": [0,0,0], "radius": 10}; an option given once stands for a
column. All rows are answered at one revision; see --follow.)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre; repeat for more balls");
  add_repeatable(command, "--radius", options->radii, "R", "Its radius, one for each or one for all");
  add_overlap_options(command, *options);
  run_or_check_when_chosen(command, options, context, query_ball);
}

void add_query_capsule(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<CapsuleOptions>();
  CLI::App& command = *parent.add_subcommand("capsule", "Ask what capsules touch");
  command.footer(R"(Examples:
  locus query capsule arena --from 0,0.4,0 --to 0,1.4,0 --radius 0.4
  locus query capsule arena --from 0,0,0 --to 9,0,0 --radius 1 --columns t,normal,point --source static

t is the distance from the inner segment, negative inside an object: radius - t says how deep. Rows:
from.x,from.y,from.z,way.x,way.y,way.z,radius[,mask,ignore_group] or {"from": [0,0,0], "way": [0,1,0], "radius": 0.4},
where way leads from the first end to the other; an option given once stands for a column.)");
  add_repeatable(command, "--from", options->from, "X,Y,Z", "One end of its inner segment; repeat for more capsules");
  add_repeatable(command, "--to", options->to, "X,Y,Z", "The other end, one for each or one for all");
  add_repeatable(command, "--radius", options->radii, "R", "Its radius, one for each or one for all");
  add_overlap_options(command, *options);
  run_or_check_when_chosen(command, options, context, query_capsule);
}

void add_query_box(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BoxOptions>();
  CLI::App& command = *parent.add_subcommand("box", "Ask what boxes touch, rotated or not");
  command.footer(R"(Examples:
  locus query box arena --at 0,0,0 --half 5,5,5
  locus query box arena --at 0,0,0 --half 5,1,1 --rotation 0,0,0.3826834,0.9238795
  locus query box arena --at 0,0,0 --half 5,5,5 --columns t,normal,point
  locus -o ndjson query box arena --at 0,0,0 --half 9,9,9 --detail sorted --max-results 100
  generator | locus -o ndjson query box arena --from-ndjson - --half 5,5,5

With the columns t, normal and point: moving the box by -t along the normal takes it out of the object or triangle.
Rows: at.x,at.y,at.z,half.x,half.y,half.z[,rotation.x,rotation.y,rotation.z,rotation.w,mask,ignore_group] or
{"at": [0,0,0], "half": [5,5,5]}; an option given once stands for a column. All rows are answered at one revision; see
--follow.)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre; repeat for more boxes");
  add_repeatable(command, "--half", options->half_extents, "X,Y,Z",
                 "Half its size along its own axes, one for each or one for all");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Unit quaternion [0,0,0,1]");
  add_overlap_options(command, *options);
  run_or_check_when_chosen(command, options, context, query_box);
}

}  // namespace locus::cli
