#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr double kMaxWaitSeconds = 3600;
constexpr absl::Duration kFirstPause = absl::Milliseconds(5);
constexpr absl::Duration kLongestPause = absl::Milliseconds(200);

struct WaitOptions {
  std::string scene;
  std::optional<uint64_t> revision;
  double seconds = 10;
};

bool is_reached(const v1::Scene& scene, const WaitOptions& options) {
  return scene.pending_changes() == 0 && scene.revision() >= options.revision.value_or(0);
}

absl::Status too_late(const v1::Scene& scene, const WaitOptions& options) {
  return absl::DeadlineExceededError(absl::StrCat("after ", options.seconds, " s scene ", options.scene,
                                                  " is at revision ", scene.revision(), " with ",
                                                  scene.pending_changes(), " changes of instances to come"));
}

Report report_of(const v1::Scene& scene) {
  Report report;
  report.head = {{"scene", scene.name()},
                 {"revision", scene.revision()},
                 {"tick", scene.tick()},
                 {"epoch", id_json(scene.epoch())}};
  if (!scene.last_build_error().empty()) report.head["last_build_error"] = scene.last_build_error();
  return report;
}

// Polls the scene until no change of instances is being built and, if options.revision is given, until this revision is
// reached. The polling interval grows, because a build can take from milliseconds to minutes.
absl::Status wait(const WaitOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const absl::Time end = absl::Now() + absl::Seconds(options.seconds);
  for (absl::Duration pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    ASSIGN_OR_RETURN(const v1::Scene scene, client->get_scene(options.scene));
    if (is_reached(scene, options)) {
      context.write(report_of(scene));
      return absl::OkStatus();
    }
    const absl::Duration left = end - absl::Now();
    if (left <= absl::ZeroDuration()) return too_late(scene, options);
    absl::SleepFor(std::min(pause, left));
  }
}

}  // namespace

void add_wait_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<WaitOptions>();
  CLI::App& command = *parent.add_subcommand("wait", "Wait until no change of a scene's instances is being built");
  command.footer(R"(Examples:
  locus wait arena
  locus wait arena --revision 12 --for 60)");
  add_scene_argument(command, options->scene);
  command.add_option("--revision", options->revision, "Also until the scene has this revision")->type_name("REVISION");
  command.add_option("--for", options->seconds, "How long at most [10]")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, kMaxWaitSeconds).description(""));
  run_when_chosen(command, options, context, wait);
}

}  // namespace locus::cli
