#include "client/cli/commands/query_command.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::StatusOr<v1::QueryResult> ask_block(const QueryOptions& options, client::QueryBuilder& builder,
                                          Context& context) {
  RETURN_IF_ERROR(check(options));
  apply_to_batch(options, context, builder);
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  absl::StatusOr<v1::QueryResult> result = client->query(options.scene, builder.build());
  if (result.ok() && result->blocks_size() != 1) {
    return absl::DataLossError(absl::StrCat("the server answered one block with ", result->blocks_size()));
  }
  return result;
}

namespace {

// Adds the key as_of to the rows of a report that has one row for each query.
void add_times(const QueryOptions& options, const v1::BlockResult& block, const Context& context, Report& report) {
  if (!rows_have_time(options.past, context.format())) return;
  const Json times = resolved_json(block);
  for (size_t i = 0; i < report.rows.size(); ++i) report.rows[i]["as_of"] = i < times.size() ? times[i] : Json();
  report.keys.emplace_back("as_of");
}

}  // namespace

absl::Status ask_and_report(const QueryOptions& options, client::QueryBuilder& builder, const RowLayout& layout,
                            const std::string& rows_name, Context& context) {
  RowLayout with_time = layout;
  with_time.as_of = rows_have_time(options.past, context.format());
  ASSIGN_OR_RETURN(const v1::QueryResult result, ask_block(options, builder, context));
  Report report;
  report.head = result_head(result);
  report.rows_name = rows_name;
  if (options.count_only) {
    const std::string query = layout.query.empty() ? "query" : layout.query;
    for (int i = 0; i < result.blocks(0).counts_size(); ++i)
      report.rows.push_back({{query, i}, {"count", result.blocks(0).counts(i)}});
    report.keys = {query, "count"};
    add_times(options, result.blocks(0), context, report);
  } else {
    ASSIGN_OR_RETURN(report.rows, rows_json(result.blocks(0), with_time));
    report.keys = row_keys(with_time);
  }
  context.write(report);
  return absl::OkStatus();
}

absl::Status ask_and_report_any(const QueryOptions& options, client::QueryBuilder& builder, const std::string& query,
                                Context& context) {
  ASSIGN_OR_RETURN(const v1::QueryResult result, ask_block(options, builder, context));
  ASSIGN_OR_RETURN(const client::AnyHits hits, client::AnyHits::of(result.blocks(0)));
  Report report;
  report.head = result_head(result);
  report.rows_name = query + "s";
  report.keys = {query, "hit"};
  for (size_t i = 0; i < hits.size(); ++i) report.rows.push_back({{query, i}, {"hit", hits.hit(i)}});
  add_times(options, result.blocks(0), context, report);
  context.write(report);
  return absl::OkStatus();
}

void add_query_command(CLI::App& parent, Context& context) {
  CLI::App& command =
      *parent.add_subcommand("query", "Ask what rays hit, what solids touch, who sees whom, and what is nearest");
  command.footer(R"(Examples:
  locus query ray arena --from 0,1,0 --dir 0,0,-1
  locus query ball arena --at 0,0,0 --radius 10
  locus query box arena --at 0,0,0 --half 5,5,5
  locus query sweep arena --from 0,1,0 --to 9,1,0 --radius 0.4
  locus query sight arena --viewer 0,1.7,0 --target 20,1.5,3
  locus query nearest arena --at 0,0,0 --k 5
  locus query ray arena --from 0,1,0 --dir 0,0,-1 --as-of 120+0.5
  locus -o csv query ray arena --from-csv rays.csv > hits.csv)");
  command.require_subcommand(1);
  add_query_ray(command, context);
  add_query_ball(command, context);
  add_query_box(command, context);
  add_query_capsule(command, context);
  add_query_sweep(command, context);
  add_query_frustum(command, context);
  add_query_contains(command, context);
  add_query_sight(command, context);
  add_query_nearest(command, context);
  add_query_pairs(command, context);
  add_query_cell(command, context);
}

}  // namespace locus::cli
