#include "tests/bench/serving/redis_cases.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/redis.h"
#include "tests/bench/serving/update_load.h"

namespace locus::bench::serving {
namespace {

using dynamic::name_of_count;

constexpr size_t kMovesAMessage = 4096;
constexpr size_t kBallsAMessage = 1024;
constexpr size_t kWindow = 8;  // messages in flight to locus, and GEOADD commands of 4,096 positions in flight to Redis
constexpr size_t kSearchWindow = 256;  // GEOSEARCH commands in flight to Redis
constexpr float kReach = dynamic::kReach;

// Metres on Redis's globe per unit of the world. Redis rounds positions to 52 bits, 0.6 m at the equator. At 20 m per
// unit the world's 2,000 units are 40 km around (0, 0). There the globe's curvature distorts lengths by a relative
// error below 5e-6, and the rounding error is up to 0.015 units on each axis.
constexpr double kMetres = 20;
constexpr double kEarthRadius = 6372797.560856;  // radius that Redis uses, in metres
constexpr double kDegrees = kMetres / kEarthRadius * 180 / std::numbers::pi;
// Tolerated difference of the hit counts, as a part of all hits. About 2 * 0.01 / kReach of a ball's hits are so close
// to its border that Redis may decide differently, but wrong hits and wrong misses nearly cancel in the count.
constexpr double kMayDiffer = 0.001;
constexpr double kFewHits = 5;

std::string longitude(float x) { return absl::StrFormat("%.8f", (double{x} - dynamic::kSide / 2) * kDegrees); }

// Number of objects in a case of balls, and the required ratio.
struct BallBar {
  uint32_t count;
  double bar;
};
constexpr BallBar kBalls[] = {{10'000, 5}, {100'000, 10}, {1'000'000, 50}};

class FlatWorld {
 public:
  explicit FlatWorld(uint32_t count) : world_(dynamic::Kind::kUniform, count) {}

  const dynamic::World& world() const { return world_; }
  void step() { world_.step(); }

  v1::UpdateBatch insert() const {
    v1::UpdateBatch batch;
    v1::Insert* const insert = batch.add_inserts();
    insert->mutable_point();
    fill(0, world_.count(), *insert);
    return batch;
  }
  // Appends moves of all objects: messages for locus to `ours`, and commands for Redis to `redis`.
  void add_moves(const std::string& scene, std::vector<v1::StreamUpdatesRequest>& ours,
                 std::vector<std::string>& redis) const {
    for (size_t first = 0; first < world_.count(); first += kMovesAMessage) {
      const size_t end = std::min<size_t>(world_.count(), first + kMovesAMessage);
      v1::StreamUpdatesRequest& message = ours.emplace_back();
      message.set_scene(scene);
      fill(first, end, *message.mutable_batch()->add_moves());
      redis.push_back(geoadd(first, end));
    }
  }
  std::string geoadd(size_t first, size_t end) const {
    std::vector<std::string> words = {"GEOADD", "world"};
    for (size_t i = first; i < end; ++i) {
      words.push_back(longitude(position(i, 0)));
      words.push_back(longitude(position(i, 1)));
      words.push_back(absl::StrCat(i));
    }
    return redis_command(words);
  }

 private:
  float position(size_t object, size_t axis) const { return world_.objects().positions[3 * object + axis]; }

  template <class Columns>
  void fill(size_t first, size_t end, Columns& columns) const {
    for (size_t i = first; i < end; ++i) {
      columns.add_ids(i + 1);
      for (const float value : {position(i, 0), position(i, 1), 0.0f}) columns.add_positions(value);
    }
  }

  dynamic::World world_;
};

class RedisCases {
 public:
  RedisCases(const ServingRun& run, const Daemon& daemon, Redis& redis) : run_(run), daemon_(daemon), redis_(redis) {}

  absl::Status run(uint32_t count, const std::string& moves_name, const std::string& ball_name, double ball_bar) {
    FlatWorld flat(count);
    TwinScene scene(daemon_, absl::StrCat("flat-", count));
    absl::Status status = scene.create();
    status.Update(scene.apply(flat.insert()));
    redis_.run({redis_command({"FLUSHALL"})}, 1, 1);
    std::vector<std::string> all;
    for (size_t first = 0; first < count; first += kMovesAMessage)
      all.push_back(flat.geoadd(first, std::min<size_t>(count, first + kMovesAMessage)));
    redis_.run(all, 1, kWindow);
    if (status.ok() && !ball_name.empty()) status = balls(flat, scene, ball_name, ball_bar);
    if (status.ok() && !moves_name.empty()) status = moves(flat, scene, moves_name);
    status.Update(redis_.status());
    return status;
  }

 private:
  absl::Status moves(FlatWorld& flat, TwinScene& scene, const std::string& name) {
    run_.progress(name);
    std::vector<v1::StreamUpdatesRequest> ours;
    std::vector<std::string> theirs;
    const size_t ticks = run_.options.quick ? 1 : 4;
    for (size_t tick = 0; tick < ticks; ++tick) {
      flat.step();
      flat.add_moves(scene.name(), ours, theirs);
    }
    UpdateLoad server(daemon_, ours, kWindow, UpdateLoad::Expect::kApplied);
    const auto count = static_cast<double>(ticks * flat.world().count());
    const std::vector<Contestant> contestants = {{"grpc", [&](size_t) { server.run(1); }, count, {}},
                                                 {"redis", [&](size_t) { redis_.run(theirs, 1, kWindow); }, count, {}}};
    const auto times = race(contestants, 1, run_.options.rounds, wall_seconds);
    const Hits hits = search_all(flat, scene, name);
    add_cells(contestants, times, cell_of(name, "ns/move", hash_of_number(hits.ours)), run_.report);
    constexpr double kBar = 4;
    note_bar(run_.report, kBar);
    return server.status();
  }

  absl::Status balls(FlatWorld& flat, TwinScene& scene, const std::string& name, double bar) {
    run_.progress(name);
    const Hits hits = search_all(flat, scene, name);
    Searches searches = searches_of(flat, scene);
    ServerLoad server(daemon_, searches.ours, 1, kWindow);
    // Redis gets only a part of the queries, since it takes longer for each.
    std::vector<std::string> theirs = searches.redis;
    theirs.resize(run_.options.quick ? 200 : theirs.size() / 4);
    const size_t passes = passes_of_a_chunk(run_, [&](size_t) { server.run(1); });
    const std::vector<Contestant> contestants = {
        {"grpc", [&](size_t) { server.run(passes); }, static_cast<double>(searches.ours.queries * passes), {}},
        {"redis", [&](size_t) { redis_.run(theirs, 1, kSearchWindow); }, static_cast<double>(theirs.size()), {}}};
    const auto times = race(contestants, 1, run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ball", hash_of_number(hits.ours)), run_.report);
    note_bar(run_.report, bar);
    return server.status();
  }

  struct Searches {
    Batches ours;
    std::vector<std::string> redis;
  };
  struct Hits {
    size_t ours = 0, redis = 0;
  };

  Searches searches_of(const FlatWorld& flat, const TwinScene& scene) const {
    const size_t count = run_.options.quick ? kBallsAMessage : 16 * kBallsAMessage;
    Searches searches;
    searches.ours.queries = count;
    const auto centers = dynamic::queries_of(flat.world(), count).centers;
    const std::string radius = absl::StrCat(kReach * kMetres);
    for (size_t i = 0; i < centers.size(); ++i) {
      if (i % kBallsAMessage == 0) searches.ours.messages.emplace_back().set_scene(scene.name());
      v1::QueryBatch* const batch = searches.ours.messages.back().mutable_batch();
      v1::Balls* const balls =
          (batch->blocks_size() == 0 ? batch->add_blocks() : batch->mutable_blocks(0))->mutable_balls();
      for (const float value : {centers[i].x, centers[i].y, 0.0f}) balls->add_centers(value);
      if (i % kBallsAMessage == 0) balls->add_radii(kReach);
      searches.redis.push_back(redis_command({"GEOSEARCH", "world", "FROMLONLAT", longitude(centers[i].x),
                                              longitude(centers[i].y), "BYRADIUS", radius, "m"}));
    }
    searches.ours.borrow();
    return searches;
  }

  // Runs every ball once on the server and once in Redis, and compares the numbers of hits.
  Hits search_all(const FlatWorld& flat, TwinScene& scene, const std::string& name) {
    Searches searches = searches_of(flat, scene);
    ServerLoad server(daemon_, searches.ours, 1, kWindow);
    server.hashes();
    redis_.run(searches.redis, 1, kSearchWindow);
    const Hits hits = {server.rows(), redis_.counted()};
    const double differ = std::abs(static_cast<double>(hits.ours) - static_cast<double>(hits.redis));
    const std::string found = absl::StrFormat("%s: %d hits by us, %d by Redis, whose places are rounded to 52 bits",
                                              name, hits.ours, hits.redis);
    run_.note(found);
    if (differ > kFewHits + kMayDiffer * static_cast<double>(hits.ours)) run_.disagree(found);
    if (!server.status().ok()) run_.disagree(absl::StrCat(name, ": ", server.status().message()));
    return hits;
  }

  const ServingRun& run_;
  const Daemon& daemon_;
  Redis& redis_;
};

}  // namespace

absl::Status run_redis_cases(const ServingRun& run) {
  struct Wanted {
    uint32_t count;
    std::string moves, ball;
    double bar;
  };
  std::vector<Wanted> all;
  const uint32_t moving = run.options.quick ? 10'000 : 100'000;
  for (const BallBar& ball : kBalls) {
    if (run.options.quick && ball.count != kBalls[0].count) continue;
    const std::string moves = absl::StrCat("moves/", name_of_count(ball.count));
    const std::string name = absl::StrCat("ball/", name_of_count(ball.count));
    const Wanted wanted = {ball.count, ball.count == moving && run.wants(moves) ? moves : "",
                           run.wants(name) ? name : "", ball.bar};
    if (!wanted.moves.empty() || !wanted.ball.empty()) all.push_back(wanted);
  }
  if (all.empty()) return absl::OkStatus();
  const auto redis = Redis::start();
  if (!redis.ok()) {
    run.note(absl::StrCat("a peer is missing: ", redis.status().message()));
    return absl::OkStatus();
  }
  const auto daemon = Daemon::start();
  if (!daemon.ok()) return daemon.status();
  RedisCases cases(run, **daemon, **redis);
  absl::Status status;
  for (const Wanted& wanted : all)
    if (status.ok()) status = cases.run(wanted.count, wanted.moves, wanted.ball, wanted.bar);
  return status;
}

}  // namespace locus::bench::serving
