#include "client/cli/commands/scene_up.h"

#include "client/cli/choices.h"

namespace locus::cli {

UpAxis up_of(const v1::Scene& scene) {
  const auto label = scene.spec().labels().find(kUpLabel);
  return label != scene.spec().labels().end() && label->second == up_name(UpAxis::kY) ? UpAxis::kY : UpAxis::kZ;
}

UpAxis up_of_format(const std::string& source_format) {
  return source_format == "glTF" || source_format == "GLB" ? UpAxis::kY : UpAxis::kZ;
}

std::string up_name(UpAxis up) { return up == UpAxis::kY ? "y" : "z"; }

void add_up_option(CLI::App& command, std::optional<UpAxis>& up, const std::string& description) {
  const NamedValues<UpAxis> axes = {{"y", UpAxis::kY}, {"z", UpAxis::kZ}};
  command.add_option("--up", up, description)->type_name("AXIS")->transform(choices(axes));
}

}  // namespace locus::cli
