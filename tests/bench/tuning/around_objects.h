// Queries around the objects of a scene, as rows of `locus query` and as batches for a client. Used by the suite
// tuning. Functions without state.
#ifndef LOCUS_TESTS_BENCH_TUNING_AROUND_OBJECTS_H_
#define LOCUS_TESTS_BENCH_TUNING_AROUND_OBJECTS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/client.h"

namespace locus::bench::tuning {

// Queries whose positions are those of random objects of a scene, moved by up to 5 on each axis.
struct AroundObjects {
  struct Ray {
    std::vector<double> origin, direction;  // the direction is as long as the ray
  };
  std::vector<std::vector<double>> balls;
  std::vector<Ray> rays;
  std::vector<std::vector<double>> points;  // for nearest
  double radius = 0;
};

// Kinds of query of a case.
enum class Kinds { kAll, kBalls };

// Returns `count` queries of each kind at the present objects of the scene, by fixed seeds.
absl::StatusOr<AroundObjects> around_objects(const client::Client& client, const std::string& scene, Kinds kinds,
                                             double radius, size_t count);

// Writes balls.csv, rays.csv and points.csv, those that have rows, to the folder and returns their paths.
absl::StatusOr<std::vector<std::string>> write_rows(const AroundObjects& queries, const std::string& folder);

// Returns the same queries as batches with `explain`.
std::vector<v1::QueryBatch> batches_of(const AroundObjects& queries);

}  // namespace locus::bench::tuning

#endif  // LOCUS_TESTS_BENCH_TUNING_AROUND_OBJECTS_H_
