#include "client/cli/commands/dump_command.h"

#include <memory>
#include <string>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/report_stream.h"
#include "client/cli/rows/scene_rows.h"
#include "client/lib/client.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kDumpWidthRows = 1000;  // number of first rows that determine a table's column widths

struct DumpOptions {
  std::string scene;
  ViewOptions view;
};

absl::Status dump(const DumpOptions& options, Context& context) {
  return dump_things(options.scene, options.view, {.rows_name = "things", .no_rows = "an empty scene"}, context);
}

}  // namespace

absl::Status dump_things(const std::string& scene, const ViewOptions& view, const DumpTexts& texts, Context& context) {
  RETURN_IF_ERROR(check(view));
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const Things things = things_of(view);
  ReportStream stream(context.out(), context.options().format,
                      {.rows_name = texts.rows_name,
                       .keys = thing_keys(things),
                       .no_rows = texts.no_rows,
                       .width_rows = kDumpWidthRows});
  bool begun = false;
  const auto take = [&](const v1::DumpSceneResponse& message) {
    const Json head = {{"scene", scene}, {"epoch", id_json(message.epoch())}, {"revision", message.revision()}};
    if (!begun) stream.begin(head);
    begun = true;
    return for_each_thing(message, [&](const SceneThing& thing) {
      if (is_among(things, thing.kind)) stream.add(thing_row(thing, things));
      return absl::OkStatus();
    });
  };
  const absl::Status dumped = client->dump(dump_request(scene, view, context), take);
  if (begun) stream.end();
  return dumped;
}

void add_dump_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<DumpOptions>();
  CLI::App& command =
      *parent.add_subcommand("dump", "Write everything in a scene at one revision, objects and instances, by id");
  command.footer(R"(Examples:
  locus dump arena
  locus -o ndjson dump arena --objects | locus insert copy mixed --from-ndjson -
  locus -o json dump arena --exactly 12 --epoch 0x5f3a)");
  add_scene_argument(command, options->scene);
  add_view_options(command, options->view);
  run_when_chosen(command, options, context, dump);
}

}  // namespace locus::cli
