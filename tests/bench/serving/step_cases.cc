#include "tests/bench/serving/step_cases.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/stream_load.h"

namespace locus::bench::serving {
namespace {

constexpr const char* kUnary = "step/shooter_unary";
constexpr const char* kStream = "step/shooter_stream";
constexpr const char* kScene = "shooter";
constexpr int kPlayers = 64, kSightRays = 512;
constexpr uint64_t kFirstPlayer = 1, kLevel = 1000;
constexpr uint32_t kHistoryTicks = 32;
constexpr uint64_t kFirstTick = kHistoryTicks;
constexpr double kStepBar = 1 / 0.65;

// The players of a shooter in a level: they start at random points of the level and walk on circles. Makes the messages
// of each tick: the moves of all players; one rewound shot of each player at another one; rays of sight between the
// players, which the level blocks; and a box about each player.
class Shooter {
 public:
  explicit Shooter(const BenchMesh& mesh) : step_(mesh.diagonal * 0.001f), reach_(mesh.diagonal * 0.02f) {
    for (const RayQuery& ray : scattered_rays(mesh, kPlayers)) starts_.push_back(ray.origin);
  }

  v1::UpdateBatch entry() const {
    v1::UpdateBatch batch;
    batch.set_tick(0);
    v1::Insert& insert = *batch.add_inserts();
    for (int i = 0; i < kPlayers; ++i) {
      insert.add_ids(kFirstPlayer + static_cast<uint64_t>(i));
      insert.add_groups(kFirstPlayer + static_cast<uint64_t>(i));
      add(*insert.mutable_positions(), position(i, 0));
    }
    insert.mutable_ball()->add_radii(step_);
    return batch;
  }

  void set_moves(uint64_t tick, v1::UpdateBatch& batch) const {
    batch.Clear();
    batch.set_tick(tick);
    v1::Move& move = *batch.add_moves();
    for (int i = 0; i < kPlayers; ++i) {
      move.add_ids(kFirstPlayer + static_cast<uint64_t>(i));
      add(*move.mutable_positions(), position(i, tick));
    }
  }

  void set_queries(uint64_t tick, v1::QueryBatch& batch) const {
    batch.Clear();
    v1::QueryBlock& shots = *batch.add_blocks();
    for (int i = 0; i < kPlayers; ++i) {
      const uint64_t seen = tick - 1 - static_cast<uint64_t>(i % 8);
      const int target = (i + 1) % kPlayers;
      shots.add_as_of_ticks(seen);
      shots.add_as_of_fractions(0.25f);
      shots.add_ignore_groups(kFirstPlayer + static_cast<uint64_t>(i));
      add_ray(*shots.mutable_rays(), position(i, tick), position(target, seen));
    }
    v1::QueryBlock& sight = *batch.add_blocks();
    sight.set_source(v1::SOURCE_STATIC);
    sight.mutable_rays()->set_mode(v1::RAY_MODE_ANY);
    sight.mutable_rays()->add_t_max(1);
    for (int i = 0; i < kSightRays; ++i) {
      const int viewer = i % kPlayers, target = (viewer + 1 + i / kPlayers) % kPlayers;
      add_ray(*sight.mutable_rays(), position(viewer, tick), position(target, tick));
    }
    v1::Boxes& boxes = *batch.add_blocks()->mutable_boxes();
    batch.mutable_blocks(2)->set_source(v1::SOURCE_DYNAMIC);
    for (int i = 0; i < kPlayers; ++i) add(*boxes.mutable_centers(), position(i, tick));
    for (int axis = 0; axis < 3; ++axis) boxes.add_half_extents(reach_);
  }

 private:
  template <class Column>
  static void add(Column& column, const Vec3f& value) {
    for (int axis = 0; axis < 3; ++axis) column.Add(value[axis]);
  }
  static void add_ray(v1::Rays& rays, const Vec3f& from, const Vec3f& to) {
    add(*rays.mutable_origins(), from);
    for (int axis = 0; axis < 3; ++axis) rays.add_directions(to[axis] - from[axis]);
  }

  Vec3f position(int player, uint64_t tick) const {
    const float angle = 0.1f * static_cast<float>(tick % 10'000) + static_cast<float>(player);
    Vec3f at = starts_[static_cast<size_t>(player)];
    at.x += 4 * step_ * std::cos(angle);
    at.y += 4 * step_ * std::sin(angle);
    return at;
  }

  const float step_, reach_;
  std::vector<Vec3f> starts_;
};

// One way to make the ticks of a shooter, in one or two messages each. prepare() makes the messages of the next ticks;
// run() sends them, one tick after another, and waits for the answers to each.
class Way {
 public:
  explicit Way(const Shooter& shooter) : shooter_(shooter) {}
  virtual ~Way() = default;
  Way(const Way&) = delete;
  Way& operator=(const Way&) = delete;

  void prepare(uint64_t first, size_t ticks) {
    first_ = first;
    ticks_ = ticks;
    for (size_t i = 0; i < ticks; ++i) make(i, first + i);
  }
  void run() {
    for (size_t i = 0; i < ticks_ && failure_.ok(); ++i) {
      failure_ = send(i);
      const bool is_whole = ack_.applied() == kPlayers && result_.blocks_size() == 3 && result_.tick() == first_ + i;
      if (failure_.ok() && !is_whole) failure_ = absl::DataLossError("a tick was not answered as a whole");
    }
  }
  const absl::Status& failure() const { return failure_; }
  // Returns the answer to the last tick without its revision.
  std::string answer() const {
    v1::QueryResult result = result_;
    result.clear_revision();
    return result.SerializeAsString();
  }

 protected:
  // Makes the messages of the tick `number`, the `i`th of those that are prepared.
  virtual void make(size_t i, uint64_t number) = 0;
  virtual absl::Status send(size_t i) = 0;

  const Shooter& shooter_;
  v1::UpdateAck ack_;
  v1::QueryResult result_;

 private:
  uint64_t first_ = 0;
  size_t ticks_ = 0;
  absl::Status failure_;
};

// Returns entry `i` of a list of messages, which grows as needed.
template <class Message>
Message& message_at(std::vector<Message>& messages, size_t i) {
  if (messages.size() <= i) messages.resize(i + 1);
  messages[i].set_scene(kScene);
  return messages[i];
}

class UnaryStep final : public Way {
 public:
  UnaryStep(const Shooter& shooter, const std::shared_ptr<grpc::Channel>& channel)
      : Way(shooter), stub_(v1::QueryService::NewStub(channel)) {}

 private:
  void make(size_t i, uint64_t number) override {
    v1::StepRequest& request = message_at(requests_, i);
    shooter_.set_moves(number, *request.mutable_update());
    shooter_.set_queries(number, *request.mutable_queries());
  }
  absl::Status send(size_t i) override {
    grpc::ClientContext context;
    v1::StepResponse response;
    if (const grpc::Status status = stub_->Step(&context, requests_[i], &response); !status.ok()) return failed(status);
    ack_.Swap(response.mutable_ack());
    result_.Swap(response.mutable_result());
    return absl::OkStatus();
  }

  const std::unique_ptr<v1::QueryService::Stub> stub_;
  std::vector<v1::StepRequest> requests_;
};

class TwoCalls final : public Way {
 public:
  TwoCalls(const Shooter& shooter, const std::shared_ptr<grpc::Channel>& channel)
      : Way(shooter),
        update_stub_(v1::UpdateService::NewStub(channel)),
        query_stub_(v1::QueryService::NewStub(channel)) {}

 private:
  void make(size_t i, uint64_t number) override {
    shooter_.set_moves(number, *message_at(updates_, i).mutable_batch());
    shooter_.set_queries(number, *message_at(queries_, i).mutable_batch());
  }
  absl::Status send(size_t i) override {
    grpc::ClientContext update_context, query_context;
    v1::ApplyUpdatesResponse applied;
    v1::QueryResponse answered;
    if (const grpc::Status status = update_stub_->ApplyUpdates(&update_context, updates_[i], &applied); !status.ok())
      return failed(status);
    queries_[i].mutable_batch()->mutable_view()->set_at_least(applied.ack().revision());
    if (const grpc::Status status = query_stub_->Query(&query_context, queries_[i], &answered); !status.ok())
      return failed(status);
    ack_.Swap(applied.mutable_ack());
    result_.Swap(answered.mutable_result());
    return absl::OkStatus();
  }

  const std::unique_ptr<v1::UpdateService::Stub> update_stub_;
  const std::unique_ptr<v1::QueryService::Stub> query_stub_;
  std::vector<v1::ApplyUpdatesRequest> updates_;
  std::vector<v1::QueryRequest> queries_;
};

absl::Status broken() { return absl::DataLossError("the server ended a stream"); }

class StreamedStep final : public Way {
 public:
  StreamedStep(const Shooter& shooter, const std::shared_ptr<grpc::Channel>& channel)
      : Way(shooter), stub_(v1::QueryService::NewStub(channel)), stream_(stub_->StreamQueries(&context_)) {}
  ~StreamedStep() override { context_.TryCancel(); }

 private:
  void make(size_t i, uint64_t number) override {
    v1::StreamQueriesRequest& request = message_at(requests_, i);
    shooter_.set_moves(number, *request.mutable_update());
    shooter_.set_queries(number, *request.mutable_batch());
  }
  absl::Status send(size_t i) override {
    if (!stream_->Write(requests_[i]) || !stream_->Read(&response_)) return broken();
    ack_.Swap(response_.mutable_ack());
    result_.Swap(response_.mutable_result());
    return absl::OkStatus();
  }

  grpc::ClientContext context_;
  const std::unique_ptr<v1::QueryService::Stub> stub_;
  const std::unique_ptr<grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> stream_;
  std::vector<v1::StreamQueriesRequest> requests_;
  v1::StreamQueriesResponse response_;
};

class TwoStreams final : public Way {
 public:
  TwoStreams(const Shooter& shooter, const std::shared_ptr<grpc::Channel>& channel)
      : Way(shooter),
        update_stub_(v1::UpdateService::NewStub(channel)),
        query_stub_(v1::QueryService::NewStub(channel)),
        update_stream_(update_stub_->StreamUpdates(&update_context_)),
        query_stream_(query_stub_->StreamQueries(&query_context_)) {}
  ~TwoStreams() override {
    update_context_.TryCancel();
    query_context_.TryCancel();
  }

 private:
  void make(size_t i, uint64_t number) override {
    shooter_.set_moves(number, *message_at(updates_, i).mutable_batch());
    shooter_.set_queries(number, *message_at(queries_, i).mutable_batch());
  }
  absl::Status send(size_t i) override {
    if (!update_stream_->Write(updates_[i]) || !update_stream_->Read(&applied_)) return broken();
    queries_[i].mutable_batch()->mutable_view()->set_at_least(applied_.ack().revision());
    if (!query_stream_->Write(queries_[i]) || !query_stream_->Read(&answered_)) return broken();
    ack_.Swap(applied_.mutable_ack());
    result_.Swap(answered_.mutable_result());
    return absl::OkStatus();
  }

  grpc::ClientContext update_context_, query_context_;
  const std::unique_ptr<v1::UpdateService::Stub> update_stub_;
  const std::unique_ptr<v1::QueryService::Stub> query_stub_;
  const std::unique_ptr<grpc::ClientReaderWriter<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>> update_stream_;
  const std::unique_ptr<grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> query_stream_;
  std::vector<v1::StreamUpdatesRequest> updates_;
  std::vector<v1::StreamQueriesRequest> queries_;
  v1::StreamUpdatesResponse applied_;
  v1::StreamQueriesResponse answered_;
};

absl::Status set_up(const Daemon& daemon, const BenchMesh& mesh, const Shooter& shooter) {
  v1::CreateSceneRequest create;
  create.set_name(kScene);
  create.mutable_spec()->set_history_ticks(kHistoryTicks);
  RETURN_IF_ERROR(daemon.client().create_scene(create).status());
  RETURN_IF_ERROR(daemon.client().upload_mesh({mesh.name, mesh.vertices, mesh.indices}).status());
  v1::ChangeInstancesRequest change;
  change.set_scene(kScene);
  v1::Placement& level = *change.add_place();
  level.set_mesh(mesh.name);
  level.add_ids(kLevel);
  for (int axis = 0; axis < 3; ++axis) level.add_translations(0);
  RETURN_IF_ERROR(daemon.client().change_instances(change).status());
  RETURN_IF_ERROR(daemon.client().apply(kScene, shooter.entry()).status());
  v1::UpdateBatch moves;
  for (uint64_t tick = 1; tick < kFirstTick; ++tick) {
    shooter.set_moves(tick, moves);
    RETURN_IF_ERROR(daemon.client().apply(kScene, moves).status());
  }
  return absl::OkStatus();
}

// Compares a step with two calls. Both make ticks of one scene in turn, so that every tick is made once.
absl::Status compare(const ServingRun& run, const std::string& name, uint64_t& tick, Way& step, Way& calls) {
  if (!run.wants(name)) return absl::OkStatus();
  run.progress(name);
  const size_t chunks = run.options.quick ? 2 : 40, ticks = run.options.quick ? 5 : 25;
  const auto prepare = [&](Way& way) {
    way.prepare(tick, ticks);
    tick += ticks;
  };
  const auto operations = static_cast<double>(chunks * ticks);
  const std::vector<Contestant> contestants = {
      {"step", [&](size_t) { step.run(); }, operations, [&](size_t) { prepare(step); }},
      {"two_calls", [&](size_t) { calls.run(); }, operations, [&](size_t) { prepare(calls); }}};
  const auto times = race(contestants, chunks, run.options.rounds, wall_seconds);
  // A second move to the same positions at the same tick changes neither the scene nor its history.
  for (Way* const way : {&step, &calls}) {
    way->prepare(tick, 1);
    way->run();
    RETURN_IF_ERROR(way->failure());
  }
  ++tick;
  if (step.answer() != calls.answer()) run.disagree(name + ": a step and two calls have different answers");
  add_cells(contestants, times, cell_of(name, "ns/tick", hash_of_number(kPlayers)), run.report);
  note_bar(run.report, kStepBar,
           absl::StrFormat(" (a step costs %.2f of two calls)", 1 / run.report.cells.back().ratio));
  return absl::OkStatus();
}

}  // namespace

absl::Status run_step_cases(const ServingRun& run) {
  if (!run.wants(kUnary) && !run.wants(kStream)) return absl::OkStatus();
  ASSIGN_OR_RETURN(const BenchMesh mesh, level_of(run));
  ASSIGN_OR_RETURN(const std::unique_ptr<Daemon> daemon, Daemon::start());
  const Shooter shooter(mesh);
  RETURN_IF_ERROR(set_up(*daemon, mesh, shooter));
  const std::shared_ptr<grpc::Channel> channel = daemon->channel();
  uint64_t tick = kFirstTick;
  UnaryStep step(shooter, channel);
  TwoCalls calls(shooter, channel);
  RETURN_IF_ERROR(compare(run, kUnary, tick, step, calls));
  StreamedStep streamed(shooter, channel);
  TwoStreams streams(shooter, channel);
  return compare(run, kStream, tick, streamed, streams);
}

}  // namespace locus::bench::serving
