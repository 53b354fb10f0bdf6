#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/query_options.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/query_report.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct GetOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::vector<Number64> groups;
  PastOptions past;
};

const std::vector<v1::Column>& columns() {
  static const auto& columns = *new std::vector<v1::Column>{v1::COLUMN_ID,    v1::COLUMN_SHAPE, v1::COLUMN_POSE,
                                                            v1::COLUMN_GROUP, v1::COLUMN_TAG,   v1::COLUMN_LAYERS};
  return columns;
}

// Returns a batch with a block that looks up the requested ids, and then a block that looks up the requested groups. A
// block with nothing to look up is omitted.
v1::QueryBatch batch_of(const GetOptions& options, const Context& context) {
  client::QueryBuilder builder;
  see_own(options.scene, context, builder);
  if (!options.ids.empty()) {
    client::LookupBlock block = builder.lookup();
    apply_to_block(options.past, block.ids(values_of(options.ids)).columns(columns()));
  }
  if (!options.groups.empty()) {
    client::LookupBlock block = builder.lookup();
    for (const Number64& group : options.groups) block.group(group.value);
    apply_to_block(options.past, block.columns(columns()));
  }
  return builder.build();
}

// Returns the requested ids that do not exist. The first block has one row for each requested id; the row of a missing
// id has id 0.
std::vector<uint64_t> missing_ids(const GetOptions& options, const v1::QueryResult& result) {
  std::vector<uint64_t> missing;
  if (options.ids.empty()) return missing;
  const auto& found = result.blocks(0).ids();
  for (size_t i = 0; i < options.ids.size(); ++i) {
    if (static_cast<int>(i) >= found.size() || found.Get(static_cast<int>(i)) == 0)
      missing.push_back(options.ids[i].value);
  }
  return missing;
}

absl::Status get(const GetOptions& options, Context& context) {
  if (options.ids.empty() && options.groups.empty()) return usage_error("nothing to get: give --id or --group");
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const v1::QueryBatch batch = batch_of(options, context);
  ASSIGN_OR_RETURN(const v1::QueryResult result, client->query(options.scene, batch));
  if (result.blocks_size() != batch.blocks_size()) return absl::DataLossError("the server left blocks unanswered");
  Report report;
  report.head = result_head(result);
  report.rows_name = "things";
  const RowLayout layout = {.columns = columns(), .as_of = rows_have_time(options.past, context.format())};
  report.keys = row_keys(layout);
  for (const v1::BlockResult& block : result.blocks()) {
    ASSIGN_OR_RETURN(std::vector<Json> rows, rows_json(block, layout));
    for (Json& row : rows) {
      if (!row["id"].is_null()) report.rows.push_back(std::move(row));
    }
  }
  const std::vector<uint64_t> missing = missing_ids(options, result);
  if (!missing.empty()) report.head["missing"] = Json::array();
  for (const uint64_t id : missing) report.head["missing"].push_back(id_json(id));
  context.write(report);
  if (missing.empty()) return absl::OkStatus();
  return absl::NotFoundError(
      absl::StrCat("scene ", options.scene, " has no object or instance with id ", absl::StrJoin(missing, ", ")));
}

}  // namespace

void add_get_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<GetOptions>();
  CLI::App& command = *parent.add_subcommand("get", "Look up objects and instances by id or group");
  command.footer(R"(Examples:
  locus get arena --id 7
  locus get arena --id 7 --id 8
  locus -o json get arena --group 3
  locus get arena --id 7 --as-of 120+0.5)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object or instance");
  add_repeatable(command, "--group", options->groups, "GROUP", "Everything in a group");
  add_past_options(command, options->past);
  run_or_check_when_chosen(command, options, context, get);
}

}  // namespace locus::cli
