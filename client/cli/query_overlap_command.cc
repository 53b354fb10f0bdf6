#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/query_command.h"

namespace locus::cli {
namespace {

struct BallOptions {
  QueryOptions query;
  std::vector<Triple> at;
  std::vector<double> radii;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

struct BoxOptions {
  QueryOptions query;
  std::vector<Triple> at;
  std::vector<Triple> half_extents;
  std::vector<Quaternion> rotations;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

// The columns to ask for and show: ids always, triangles where they are the rows.
std::vector<v1::Column> columns_of(const QueryOptions& options, v1::StaticDetail detail) {
  std::vector<v1::Column> columns = {v1::COLUMN_ID};
  if (detail == v1::STATIC_DETAIL_TRIANGLES || detail == v1::STATIC_DETAIL_TRIANGLES_SORTED) {
    columns.push_back(v1::COLUMN_TRIANGLE);
  }
  columns.insert(columns.end(), options.columns.begin(), options.columns.end());
  return columns;
}

absl::Status query_ball(const BallOptions& options, Context& context) {
  const FramedPositions at = framed(options.at);
  const RowLayout layout = {.query = "ball", .columns = columns_of(options.query, options.detail), .frame = at.frame};
  client::QueryBuilder builder;
  client::BallBlock block = builder.balls();
  block.frame(at.frame).columns(layout.columns).detail(options.detail);
  block.balls(at.offsets, floats_of(options.radii));
  apply_to_block(options.query, block);
  return ask_and_report(options.query, builder, layout, "found", context);
}

absl::Status query_box(const BoxOptions& options, Context& context) {
  const FramedPositions at = framed(options.at);
  const RowLayout layout = {.query = "box", .columns = columns_of(options.query, options.detail), .frame = at.frame};
  client::QueryBuilder builder;
  client::BoxBlock block = builder.boxes();
  block.frame(at.frame).columns(layout.columns).detail(options.detail);
  block.boxes(at.offsets, floats_of(options.half_extents)).rotations(floats_of(options.rotations));
  apply_to_block(options.query, block);
  return ask_and_report(options.query, builder, layout, "found", context);
}

// What only overlaps have.
template <class Options>
void add_overlap_options(CLI::App& command, Options& options) {
  add_detail_option(command, options.detail);
  command.add_option("--after-id", options.query.after_id, "Only higher ids: goes on after a cut")->type_name("ID");
  add_query_options(command, options.query);
}

}  // namespace

void add_query_ball(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BallOptions>();
  CLI::App& command = *parent.add_subcommand("ball", "Ask what balls touch");
  command.footer(R"(Examples:
  locus query ball arena --at 0,0,0 --radius 10
  locus query ball arena --at 0,0,0 --at 50,0,0 --radius 2.5 --source dynamic --columns group,tag
  locus query ball arena --at 1,2,3 --radius 0 --detail triangles)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre; repeat for more balls")->required();
  add_repeatable(command, "--radius", options->radii, "R", "Its radius, one for each or one for all")->required();
  add_overlap_options(command, *options);
  run_when_chosen(command, options, context, query_ball);
}

void add_query_box(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BoxOptions>();
  CLI::App& command = *parent.add_subcommand("box", "Ask what boxes touch, turned ones too");
  command.footer(R"(Examples:
  locus query box arena --at 0,0,0 --half 5,5,5
  locus query box arena --at 0,0,0 --half 5,1,1 --rotation 0,0,0.3826834,0.9238795
  locus -o ndjson query box arena --at 0,0,0 --half 9,9,9 --detail sorted --max-results 100)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Its centre; repeat for more boxes")->required();
  add_repeatable(command, "--half", options->half_extents, "X,Y,Z",
                 "Half its size along its own axes, one for each or one for all")
      ->required();
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Unit quaternion [0,0,0,1]");
  add_overlap_options(command, *options);
  run_when_chosen(command, options, context, query_box);
}

}  // namespace locus::cli
