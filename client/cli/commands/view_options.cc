#include "client/cli/commands/view_options.h"

#include "client/cli/failure.h"

namespace locus::cli {

void add_view_options(CLI::App& command, ViewOptions& options) {
  command.add_flag("--objects", options.objects, "Only objects");
  command.add_flag("--instances", options.instances, "Only instances");
  add_revision_options(command, options);
}

void add_revision_options(CLI::App& command, ViewOptions& options) {
  command.add_option("--at-least", options.at_least, "Wait for this revision")->type_name("REVISION");
  command.add_option("--exactly", options.exactly, "Read this revision, if it is still kept")->type_name("REVISION");
  command.add_option("--epoch", options.epoch, "Epoch of the revision")->type_name("EPOCH");
}

Things things_of(const ViewOptions& options) {
  if (options.objects == options.instances) return Things::kAll;
  return options.objects ? Things::kObjects : Things::kInstances;
}

absl::Status check(const ViewOptions& options) {
  if (options.at_least && options.exactly) return usage_error("give --at-least or --exactly, not both");
  return absl::OkStatus();
}

v1::DumpSceneRequest dump_request(const std::string& scene, const ViewOptions& options, const Context& context) {
  v1::DumpSceneRequest request;
  request.set_scene(scene);
  v1::View& view = *request.mutable_view();
  if (options.at_least || options.exactly) {
    view.set_epoch(options.epoch.value);
    if (options.at_least) view.set_at_least(*options.at_least);
    if (options.exactly) view.set_exactly(*options.exactly);
  } else if (const std::optional<client::Revision> own = context.own(scene)) {
    view.set_epoch(own->epoch);
    view.set_at_least(own->revision);
  }
  return request;
}

}  // namespace locus::cli
