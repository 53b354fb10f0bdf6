#include "tests/bench/serving/served_level.h"

#include <utility>

#include "core/base/status_macros.h"
#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {

absl::StatusOr<ServedLevel> ServedLevel::start(const ServingRun& run, const std::string& name) {
  ASSIGN_OR_RETURN(BenchMesh mesh, level_of(run));
  ASSIGN_OR_RETURN(std::unique_ptr<Daemon> daemon, Daemon::start());
  auto scene = std::make_unique<TwinScene>(*daemon, name);
  RETURN_IF_ERROR(scene->create());
  RETURN_IF_ERROR(scene->place(mesh));
  return ServedLevel{std::move(mesh), std::move(daemon), std::move(scene)};
}

}  // namespace locus::bench::serving
