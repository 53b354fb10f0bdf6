#include "tests/bench/serving/echo_cases.h"

#include <algorithm>
#include <utility>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/serving/echo_answer.h"
#include "tests/bench/serving/processor_time.h"
#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/update_load.h"
#include "tests/bench/serving/world_messages.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kStreams = 2;
constexpr size_t kUpdateWindow = 8;
constexpr uint64_t kWriter = 7;
constexpr uint32_t kMoving = 100'000;

struct Echo {
  size_t rays;
  size_t window;
};
constexpr Echo kEchos[] = {{1024, 4}, {8192, 2}};

struct Moves {
  size_t moves;
  double bar;  // required millions of moves per second
};
constexpr Moves kMoves[] = {{256, 30}, {4096, 75}};

std::string echo_name(const Echo& echo) { return absl::StrCat("echo/", echo.rays); }
std::string empty_name(const Echo& echo) { return absl::StrCat("empty/", echo.rays); }
std::string parsed_name(const Moves& moves) { return absl::StrCat("moves/", moves.moves); }
std::string applied_name(const Moves& moves) { return absl::StrCat("moves_applied/", moves.moves); }

// Makes batches that have 32 bytes per ray, and whose answers have 24 bytes per ray: all columns of a hit.
Batches echo_batches(size_t rays, size_t messages, const std::string& scene) {
  Batches batches;
  batches.queries = rays * messages;
  for (size_t i = 0; i < messages; ++i) {
    v1::StreamQueriesRequest& message = batches.messages.emplace_back();
    message.set_scene(scene);
    v1::QueryBlock* const block = message.mutable_batch()->add_blocks();
    for (const v1::Column column : {v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_TRIANGLE, v1::COLUMN_UV})
      block->add_columns(column);
    for (size_t ray = 0; ray < rays; ++ray) {
      for (const float value : {static_cast<float>(i), static_cast<float>(ray), 1.0f})
        block->mutable_rays()->add_origins(value);
      for (const float value : {0.0f, 0.0f, 1.0f}) block->mutable_rays()->add_directions(value);
      block->mutable_rays()->add_t_max(100);
      block->add_masks(0xFFFFFFFF);
    }
  }
  batches.borrow();
  return batches;
}

class EchoCases {
 public:
  EchoCases(const ServingRun& run, const RawTcpServer& plain, TwinScene& scene)
      : run_(run), plain_(plain), scene_(scene) {}

  // Measures columns that are sent to locus-echo and back. locus-echo runs the server's code for calls, but no queries.
  absl::Status echo(const Echo& echo) {
    const std::string name = echo_name(echo);
    if (!run_.wants(name)) return absl::OkStatus();
    const absl::StatusOr<std::unique_ptr<LocalServer>> server = LocalServer::start("locus-echo");
    if (!server.ok()) return server.status();
    Batches batches = echo_batches(echo.rays, messages_of(echo), "echo");
    std::vector<uint64_t> expected;
    for (const v1::StreamQueriesRequest& message : batches.messages) {
      v1::QueryResult result;
      answer_echo(message.batch(), result);
      expected.push_back(hash_of(result));
    }
    const absl::Status status = there_and_back(name, echo, **server, batches, expected);
    constexpr double kBar = 0.8;
    if (status.ok()) note_bar(run_.report, kBar);
    return status;
  }

  // Measures messages of the same size that are sent to the daemon, which checks the rays and runs them on an empty
  // scene.
  absl::Status empty(const Echo& echo) {
    const std::string name = empty_name(echo);
    if (!run_.wants(name)) return absl::OkStatus();
    Batches batches = echo_batches(echo.rays, messages_of(echo), scene_.name());
    const LocalLoad process(scene_.here().latest(), batches, kStreams);
    return there_and_back(name, echo, scene_.daemon(), batches, process.hashes());
  }

  // Measures moves that are read and acked but not applied: every message has the writer id and number of a batch that
  // was applied before, so the daemon treats it as a duplicate.
  absl::Status parsed(const Moves& moves) {
    const std::string name = parsed_name(moves);
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    std::vector<v1::StreamUpdatesRequest> messages = move_messages(world_, scene_.name(), moves.moves, 1);
    for (v1::StreamUpdatesRequest& message : messages) {
      message.mutable_batch()->set_writer(kWriter);
      message.mutable_batch()->set_batch(1);
    }
    UpdateLoad server(scene_.daemon(), messages, kUpdateWindow, UpdateLoad::Expect::kDuplicate);
    server.run(1);
    if (!server.status().ok()) return server.status();
    const MessageBytes bytes = {static_cast<uint32_t>(messages.front().ByteSizeLong()),
                                static_cast<uint32_t>(server.ack_bytes())};
    RawTcpLoad plain(plain_, bytes, 1, kUpdateWindow);
    const size_t passes = passes_of_a_chunk(run_, [&](size_t) { server.run(1); });
    const size_t chunk = passes * messages.size();
    const auto count = static_cast<double>(moves.moves * chunk * chunks());
    ProcessorTime time(scene_.daemon().process().pid()), plain_time(plain_.pid());
    const std::vector<Contestant> contestants = {
        {"grpc", [&](size_t) { time.during(chunk, [&] { server.run(passes); }); }, count, {}},
        {"raw_tcp", [&](size_t) { plain_time.during(chunk, [&] { plain.run(chunk); }); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/move", hash_of_number(messages.size())), run_.report);
    const double rate = 1e3 / median(times[0]);
    run_.note(absl::StrFormat("%s: %.1f M moves/s parsed and acked, required %.0f: %s", name, rate, moves.bar,
                              rate >= moves.bar ? "shown" : "MISSED"));
    note_time(name, time, plain_time);
    absl::Status status = server.status();
    status.Update(plain.status());
    return status;
  }

  // Measures ticks of a world, in which every object moves once, in the daemon and in this process.
  absl::Status applied(const Moves& moves) {
    const std::string name = applied_name(moves);
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    std::vector<v1::StreamUpdatesRequest> messages =
        move_messages(world_, scene_.name(), moves.moves, run_.options.quick ? 1 : 4);
    std::vector<UpdateBatch> columns;
    size_t count = 0;
    for (const v1::StreamUpdatesRequest& message : messages) {
      columns.push_back(columns_of(message.batch()));
      count += static_cast<size_t>(message.batch().moves(0).ids_size());
    }
    UpdateLoad server(scene_.daemon(), messages, kUpdateWindow, UpdateLoad::Expect::kApplied);
    const auto here = [&](size_t) {
      for (const UpdateBatch& batch : columns) refused_ += scene_.here().apply(batch).ok() ? 0 : 1;
    };
    const std::vector<Contestant> contestants = {
        {"grpc", [&](size_t) { server.run(1); }, static_cast<double>(count * chunks()), {}},
        {"in_process", here, static_cast<double>(count * chunks()), {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    if (refused_ != 0) run_.disagree(absl::StrCat(name, ": ", refused_, " batches were refused in process"));
    const uint64_t hash = compare_objects(name);
    add_cells(contestants, times, cell_of(name, "ns/move", hash_of_number(hash)), run_.report);
    return server.status();
  }

  absl::Status insert_objects() {
    v1::UpdateBatch batch = insert_all(world_);
    batch.set_writer(kWriter);
    batch.set_batch(1);
    return scene_.apply(batch);
  }

 private:
  size_t chunks() const { return run_.options.quick ? 1 : 8; }
  size_t messages_of(const Echo& echo) const { return (run_.options.quick ? 65'536 : 1'048'576) / echo.rays; }

  absl::Status there_and_back(const std::string& name, const Echo& echo, const LocalServer& there, Batches& batches,
                              const std::vector<uint64_t>& expected) {
    run_.progress(name);
    const size_t messages = batches.messages.size();
    ServerLoad server(there, batches, kStreams, echo.window);
    if (server.hashes() != expected) run_.disagree(absl::StrCat(name, ": other answers over gRPC"));
    if (!server.status().ok()) return server.status();
    const MessageBytes bytes = {static_cast<uint32_t>(batches.messages.front().ByteSizeLong()),
                                static_cast<uint32_t>(24 * echo.rays)};
    RawTcpLoad plain(plain_, bytes, kStreams, echo.window);
    ProcessorTime time(there.process().pid()), plain_time(plain_.pid());
    const auto count = static_cast<double>(batches.queries * chunks());
    const std::vector<Contestant> contestants = {
        {"grpc", [&](size_t) { time.during(messages, [&] { server.run(1); }); }, count, {}},
        {"raw_tcp", [&](size_t) { plain_time.during(messages, [&] { plain.run(messages); }); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ray", hash_of_number(expected.front())), run_.report);
    run_.note(
        absl::StrFormat("%s: %.1f M rays/s, plain sockets %.1f", name, 1e3 / median(times[0]), 1e3 / median(times[1])));
    note_time(name, time, plain_time);
    absl::Status status = server.status();
    status.Update(plain.status());
    return status;
  }

  void note_time(const std::string& name, const ProcessorTime& time, const ProcessorTime& plain) const {
    run_.note(
        absl::StrFormat("%s: processor time a message: %s; over plain sockets %s", name, time.text(), plain.text()));
  }

  // Verifies, by queries, that the daemon's objects are at the same positions as those of this process. Returns the
  // hash of the answers.
  uint64_t compare_objects(const std::string& name) const {
    v1::QueryBatch batch;
    v1::Balls* const balls = batch.add_blocks()->mutable_balls();
    const auto centers = dynamic::queries_of(world_, 1000).centers;
    for (const Vec3f& center : centers)
      for (const float value : {center.x, center.y, center.z}) balls->add_centers(value);
    balls->add_radii(dynamic::kReach);
    const auto there = scene_.daemon().client().query(scene_.name(), batch);
    const uint64_t here = hash_of(answer_here(*scene_.here().latest(), columns_of(batch)));
    if (!there.ok() || hash_of(*there) != here)
      run_.disagree(absl::StrCat(name, ": objects are elsewhere than in process"));
    return here;
  }

  const ServingRun& run_;
  const RawTcpServer& plain_;
  TwinScene& scene_;
  dynamic::World world_{dynamic::Kind::kUniform, kMoving};
  size_t refused_ = 0;
};

bool wants_moves(const ServingRun& run) {
  return std::any_of(std::begin(kMoves), std::end(kMoves), [&](const Moves& moves) {
    return run.wants(parsed_name(moves)) || run.wants(applied_name(moves));
  });
}

}  // namespace

bool wants_raw_tcp(const ServingRun& run) {
  return wants_moves(run) || std::any_of(std::begin(kEchos), std::end(kEchos), [&](const Echo& echo) {
           return run.wants(echo_name(echo)) || run.wants(empty_name(echo));
         });
}

absl::Status run_echo_cases(const ServingRun& run, const RawTcpServer& plain) {
  const auto daemon = Daemon::start();
  if (!daemon.ok()) return daemon.status();
  TwinScene scene(**daemon, "echo");
  absl::Status status = scene.create();
  EchoCases cases(run, plain, scene);
  for (const Echo& echo : kEchos) {
    if (status.ok()) status = cases.echo(echo);
    if (status.ok()) status = cases.empty(echo);
  }
  if (status.ok() && wants_moves(run)) status = cases.insert_objects();
  for (const Moves& moves : kMoves) {
    if (status.ok()) status = cases.parsed(moves);
    if (status.ok()) status = cases.applied(moves);
  }
  return status;
}

}  // namespace locus::bench::serving
