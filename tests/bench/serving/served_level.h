// The level of a run, placed in a locusd that the benchmark starts and in this process. Used by cases that compare the
// daemon with direct calls of the core. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_SERVED_LEVEL_H_
#define LOCUS_TESTS_BENCH_SERVING_SERVED_LEVEL_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/serving/twin_scene.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::serving {

struct ServedLevel {
  // Loads the level of `run`, starts a daemon and places the level in the twin scene `name`. Returns the first error.
  static absl::StatusOr<ServedLevel> start(const ServingRun& run, const std::string& name);

  BenchMesh mesh;
  std::unique_ptr<Daemon> daemon;
  std::unique_ptr<TwinScene> scene;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SERVED_LEVEL_H_
