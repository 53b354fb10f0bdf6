#include "client/cli/extras/bench/bench_load.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/lib/query_builder.h"
#include "client/lib/status.h"
#include "client/lib/update_builder.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr float kRegionShare = 0.02f;  // largest size of a region, as part of the longest side of the bounds
constexpr uint32_t kNearestCount = 4;
constexpr float kObjectRadius = 0.5f;
constexpr std::chrono::milliseconds kProgressPause{50};
constexpr absl::Duration kRefusalPause = absl::Milliseconds(10);  // shortest wait after a refused batch

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

client::Float3 float3(Vec3f v) { return {v.x, v.y, v.z}; }

Vec3d centre_of(const BenchLoad& load) { return (load.bounds.min + load.bounds.max) * 0.5; }

// Returns a random point inside the bounds, relative to their centre.
Vec3f random_place(const BenchLoad& load, DemoRandom& random) {
  const Vec3f half = to_float(load.bounds.extent() * 0.5);
  const Vec3f at = random.cube();
  return {at.x * half.x, at.y * half.y, at.z * half.z};
}

client::Double3 random_position(const BenchLoad& load, DemoRandom& random) {
  const Vec3d centre = centre_of(load);
  const Vec3f at = random_place(load, random);
  return {centre.x + at.x, centre.y + at.y, centre.z + at.z};
}

// One connection under load. Not thread-safe.
class Connection {
 public:
  Connection(const client::Client& client, const BenchLoad& load, uint64_t index, uint64_t connections)
      : load_(load), random_(load.seed * 1000 + index) {
    const uint64_t share = load.objects / connections;
    first_ = 1 + index * share;
    count_ = index + 1 == connections ? load.objects - index * share : share;
    next_ = first_;
    if (load.kind == BenchKind::kMoves) {
      updates_ = client.update_stream(load.scene, {.lane = client::Lane::kLatency});
    } else {
      queries_ = client.query_stream(load.scene, {.lane = client::Lane::kLatency});
    }
  }

  // Sends batches one after another until `done`. Adds the items to `items` as they are answered.
  absl::Status run(const std::atomic<bool>& done, std::atomic<uint64_t>& items) {
    do {
      const Clock::time_point start = Clock::now();
      uint64_t answered = 0;
      const absl::Status status = updates_ != nullptr ? move(answered) : query(answered);
      if (!status.ok()) {
        if (!absl::IsResourceExhausted(status)) return status;  // the next batch would fail, too
        ++figures_.refused;
        absl::SleepFor(std::max(client::retry_after(status), kRefusalPause));
        continue;
      }
      figures_.milliseconds.push_back(1000 * seconds_since(start));
      ++figures_.batches;
      figures_.items += answered;
      items.fetch_add(answered, std::memory_order_relaxed);
    } while (!done.load(std::memory_order_relaxed));
    return updates_ != nullptr ? updates_->close() : queries_->close();
  }

  const BenchFigures& figures() const { return figures_; }

 private:
  absl::Status query(uint64_t& answered) {
    RETURN_IF_ERROR(queries_->send(bench_queries(load_, random_)).get().status());
    answered = load_.batch;
    return absl::OkStatus();
  }

  // Moves the next objects of this connection, beginning again after the last.
  absl::Status move(uint64_t& answered) {
    const uint64_t count = std::min<uint64_t>(load_.batch, first_ + count_ - next_);
    ASSIGN_OR_RETURN(const v1::UpdateAck ack, updates_->send(bench_moves(load_, next_, count, random_)).get());
    answered = ack.applied();
    figures_.refused += ack.refused();
    next_ += count;
    if (next_ == first_ + count_) next_ = first_;
    return absl::OkStatus();
  }

  const BenchLoad& load_;
  DemoRandom random_;
  uint64_t first_ = 0, count_ = 0, next_ = 0;  // moves: ids of the objects of this connection, and the next one
  std::unique_ptr<client::QueryStream> queries_;
  std::unique_ptr<client::UpdateStream> updates_;
  BenchFigures figures_;
};

}  // namespace

double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const double rank = std::ceil(fraction * static_cast<double>(values.size()));
  const size_t index = std::min(values.size(), static_cast<size_t>(std::max(1.0, rank))) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

v1::QueryBatch bench_queries(const BenchLoad& load, DemoRandom& random) {
  LOCUS_CHECK(load.kind != BenchKind::kMoves);
  const Vec3d centre = centre_of(load);
  const client::Double3 frame{centre.x, centre.y, centre.z};
  const float length = static_cast<float>(max_component(load.bounds.extent()));
  client::QueryBuilder builder;
  if (load.kind == BenchKind::kRays) {
    client::RayBlock rays = builder.rays();
    rays.frame(frame);
    for (uint32_t i = 0; i < load.batch; ++i)
      rays.ray(float3(random_place(load, random)), float3(random.direction() * length));
  } else if (load.kind == BenchKind::kBalls) {
    client::BallBlock balls = builder.balls();
    balls.frame(frame);
    for (uint32_t i = 0; i < load.batch; ++i)
      balls.ball(float3(random_place(load, random)), length * kRegionShare * random.unit());
  } else if (load.kind == BenchKind::kBoxes) {
    client::BoxBlock boxes = builder.boxes();
    boxes.frame(frame);
    for (uint32_t i = 0; i < load.batch; ++i) {
      const Vec3f half = Vec3f{random.unit(), random.unit(), random.unit()} * (kRegionShare * length);
      boxes.box(float3(random_place(load, random)), float3(half));
    }
  } else {
    client::NearestBlock nearest = builder.nearest();
    nearest.frame(frame).k(kNearestCount);
    for (uint32_t i = 0; i < load.batch; ++i) nearest.point(float3(random_place(load, random)));
  }
  return builder.build();
}

v1::UpdateBatch bench_inserts(const BenchLoad& load, uint64_t first, uint64_t count, DemoRandom& random) {
  client::UpdateBuilder builder;
  for (uint64_t i = 0; i < count; ++i) builder.insert_ball(first + i, random_position(load, random), kObjectRadius);
  return builder.build();
}

v1::UpdateBatch bench_moves(const BenchLoad& load, uint64_t first, uint64_t count, DemoRandom& random) {
  client::UpdateBuilder builder;
  for (uint64_t i = 0; i < count; ++i) builder.move(first + i, random_position(load, random));
  return builder.build();
}

absl::StatusOr<BenchFigures> run_bench(const std::vector<std::unique_ptr<client::Client>>& connections,
                                       const BenchLoad& load, const std::function<void(uint64_t items)>& on_progress) {
  std::vector<std::unique_ptr<Connection>> loaded;
  for (const std::unique_ptr<client::Client>& client : connections)
    loaded.push_back(std::make_unique<Connection>(*client, load, loaded.size(), connections.size()));
  std::atomic<bool> done = false;
  std::atomic<uint64_t> items = 0;
  std::vector<absl::Status> ends(loaded.size());
  std::vector<std::thread> threads;
  const Clock::time_point start = Clock::now();
  for (size_t i = 0; i < loaded.size(); ++i) {
    threads.emplace_back([&, i] {
      ends[i] = loaded[i]->run(done, items);
      if (!ends[i].ok()) done.store(true);
    });
  }
  while (!done.load() && seconds_since(start) < load.seconds) {
    std::this_thread::sleep_for(kProgressPause);
    on_progress(items.load());
  }
  done.store(true);
  for (std::thread& thread : threads) thread.join();
  BenchFigures figures;
  figures.seconds = seconds_since(start);
  for (const absl::Status& end : ends) RETURN_IF_ERROR(end);
  for (const std::unique_ptr<Connection>& connection : loaded) {
    const BenchFigures& part = connection->figures();
    figures.items += part.items;
    figures.batches += part.batches;
    figures.refused += part.refused;
    figures.milliseconds.insert(figures.milliseconds.end(), part.milliseconds.begin(), part.milliseconds.end());
  }
  return figures;
}

}  // namespace locus::cli
