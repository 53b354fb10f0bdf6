#include "tests/bench/tuning/around_objects.h"

#include <cmath>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "client/lib/query_builder.h"
#include "core/base/status_macros.h"

namespace locus::bench::tuning {
namespace {

constexpr double kJitter = 5, kRayLength = 100;
constexpr size_t kQueriesInBatch = 64;

client::Float3 floats(const std::vector<double>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

std::string line(const std::vector<double>& numbers) {
  return absl::StrCat(
      absl::StrJoin(numbers, ",", [](std::string* out, double number) { absl::StrAppendFormat(out, "%.9g", number); }),
      "\n");
}

// Calls add(begin, end) for consecutive ranges of up to kQueriesInBatch of `count` queries.
template <class Add>
void for_each_range(size_t count, const Add& add) {
  for (size_t begin = 0; begin < count; begin += kQueriesInBatch) add(begin, std::min(begin + kQueriesInBatch, count));
}

}  // namespace

absl::StatusOr<AroundObjects> around_objects(const client::Client& client, const std::string& scene, Kinds kinds,
                                             double radius, size_t count) {
  std::vector<double> positions;
  v1::DumpSceneRequest request;
  request.set_scene(scene);
  RETURN_IF_ERROR(client.dump(request, [&](const v1::DumpSceneResponse& message) {
    for (const v1::Insert& run : message.objects())
      positions.insert(positions.end(), run.positions_f64().begin(), run.positions_f64().end());
    return absl::OkStatus();
  }));
  if (positions.empty()) return absl::FailedPreconditionError(absl::StrCat("scene ", scene, " has no objects"));
  cli::SplitMix64 random(11);
  const auto place = [&] {
    const size_t object = random.below(static_cast<uint32_t>(positions.size() / 3));
    std::vector<double> at(3);
    for (size_t axis = 0; axis < 3; ++axis) at[axis] = positions[3 * object + axis] + kJitter * (2 * random.unit() - 1);
    for (double& coordinate : at) coordinate = double{static_cast<float>(coordinate)};
    return at;
  };
  AroundObjects queries;
  queries.radius = radius;
  for (size_t i = 0; i < count; ++i) {
    queries.balls.push_back(place());
    if (kinds == Kinds::kBalls) continue;
    const double angle = 6.2831853 * random.unit(), rise = 0.4 * random.unit() - 0.2;
    queries.rays.push_back({place(), {kRayLength * std::cos(angle), kRayLength * std::sin(angle), kRayLength * rise}});
    queries.points.push_back(place());
  }
  return queries;
}

absl::StatusOr<std::vector<std::string>> write_rows(const AroundObjects& queries, const std::string& folder) {
  std::vector<std::string> paths;
  std::ofstream balls(paths.emplace_back(absl::StrCat(folder, "/balls.csv")));
  balls << "at.x,at.y,at.z,radius\n";
  for (std::vector<double> at : queries.balls) {
    at.push_back(queries.radius);
    balls << line(at);
  }
  if (!balls.flush()) return absl::FailedPreconditionError(absl::StrCat("cannot write to ", folder));
  if (queries.rays.empty()) return paths;
  std::ofstream rays(paths.emplace_back(absl::StrCat(folder, "/rays.csv")));
  rays << "from.x,from.y,from.z,dir.x,dir.y,dir.z,max_t\n";
  for (const AroundObjects::Ray& ray : queries.rays) {
    std::vector<double> row = ray.origin;
    row.insert(row.end(), ray.direction.begin(), ray.direction.end());
    row.push_back(1);
    rays << line(row);
  }
  std::ofstream points(paths.emplace_back(absl::StrCat(folder, "/points.csv")));
  points << "at.x,at.y,at.z\n";
  for (const std::vector<double>& at : queries.points) points << line(at);
  if (!rays.flush() || !points.flush()) return absl::FailedPreconditionError(absl::StrCat("cannot write to ", folder));
  return paths;
}

std::vector<v1::QueryBatch> batches_of(const AroundObjects& queries) {
  std::vector<v1::QueryBatch> batches;
  for_each_range(queries.balls.size(), [&](size_t begin, size_t end) {
    client::QueryBuilder builder;
    client::BallBlock block = builder.balls();
    for (size_t i = begin; i < end; ++i) block.ball(floats(queries.balls[i]), static_cast<float>(queries.radius));
    batches.push_back(builder.explain().build());
  });
  for_each_range(queries.rays.size(), [&](size_t begin, size_t end) {
    client::QueryBuilder builder;
    client::RayBlock block = builder.rays();
    for (size_t i = begin; i < end; ++i)
      block.ray(floats(queries.rays[i].origin), floats(queries.rays[i].direction), 1);
    batches.push_back(builder.explain().build());
  });
  for_each_range(queries.points.size(), [&](size_t begin, size_t end) {
    client::QueryBuilder builder;
    client::NearestBlock block = builder.nearest();
    for (size_t i = begin; i < end; ++i) block.point(floats(queries.points[i]));
    batches.push_back(builder.explain().build());
  });
  return batches;
}

}  // namespace locus::bench::tuning
