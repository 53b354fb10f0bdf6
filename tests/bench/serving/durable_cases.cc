#include "tests/bench/serving/durable_cases.h"

#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <memory>
#include <thread>
#include <utility>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/twin_scene.h"
#include "tests/bench/serving/update_load.h"
#include "tests/bench/serving/world_messages.h"

namespace locus::bench::serving {
namespace {

constexpr const char* kMovesName = "durable/256";
constexpr const char* kQueriesName = "durable_queries/256";
constexpr const char* kRestartName = "restart/1M";
constexpr size_t kWindow = 16;
constexpr size_t kMovesAMessage = 256;
constexpr uint32_t kMoving = 100'000;
constexpr const char* kScenes[] = {"local", "memory"};

std::string data_dir_option(const TemporaryFolder& folder) { return absl::StrCat("--data-dir=", folder.file("data")); }

v1::QueryBatch balls_around(const dynamic::World& world, size_t count) {
  v1::QueryBatch batch;
  v1::Balls* const balls = batch.add_blocks()->mutable_balls();
  for (const Vec3f& center : dynamic::queries_of(world, count).centers)
    for (const float value : {center.x, center.y, center.z}) balls->add_centers(value);
  balls->add_radii(dynamic::kReach);
  return batch;
}

absl::Status create(const Daemon& daemon, const std::string& name, v1::Durability durability) {
  v1::CreateSceneRequest request;
  request.set_name(name);
  request.mutable_spec()->set_durability(durability);
  return daemon.client().create_scene(request).status();
}

// Two scenes with the same objects on one daemon: acks of the first scene wait for the disk, acks of the second do not.
class DurableCases {
 public:
  DurableCases(const ServingRun& run, const Daemon& daemon) : run_(run), daemon_(daemon) {}

  absl::Status fill() {
    const v1::Durability durabilities[] = {v1::DURABILITY_LOCAL, v1::DURABILITY_MEMORY};
    absl::Status status;
    for (size_t i = 0; i < 2; ++i) {
      status.Update(create(daemon_, kScenes[i], durabilities[i]));
      status.Update(daemon_.client().apply(kScenes[i], insert_all(world_)).status());
    }
    dynamic::World here = world_;
    for (const char* scene : kScenes) {
      dynamic::World world = here;
      messages_.push_back(move_messages(world, scene, kMovesAMessage, run_.options.quick ? 1 : 4));
      world_ = world;
    }
    return status;
  }

  absl::Status moves() {
    run_.progress(kMovesName);
    std::vector<std::unique_ptr<UpdateLoad>> loads;
    for (auto& messages : messages_)
      loads.push_back(std::make_unique<UpdateLoad>(daemon_, messages, kWindow, UpdateLoad::Expect::kApplied));
    const size_t ticks = run_.options.quick ? 1 : 4;
    const auto count = static_cast<double>(ticks * kMoving * chunks());
    const std::vector<Contestant> contestants = {{"durable", [&](size_t) { loads[0]->run(1); }, count, {}},
                                                 {"memory_acks", [&](size_t) { loads[1]->run(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(kMovesName, "ns/move", hash_of_number(compare(kMovesName))), run_.report);
    constexpr double kBar = 0.5;
    note_bar(run_.report, kBar);
    const double micros = 1e-3 * static_cast<double>(kMovesAMessage);
    run_.note(absl::StrFormat("%s: %.0f us a message durable, %.0f with memory acks", kMovesName,
                              micros * median(times[0]), micros * median(times[1])));
    absl::Status status = loads[0]->status();
    status.Update(loads[1]->status());
    return status;
  }

  // Measures queries of a third scene while a stream sends 256,000 moves a second to one of the two scenes.
  absl::Status queries() {
    run_.progress(kQueriesName);
    Batches batches;
    batches.queries = 64 * kBallsAMessage;
    for (int i = 0; i < 64; ++i) {
      v1::StreamQueriesRequest& message = batches.messages.emplace_back();
      message.set_scene("still");
      *message.mutable_batch() = balls_around(world_, kBallsAMessage);
    }
    batches.borrow();
    absl::Status status = create(daemon_, "still", v1::DURABILITY_MEMORY);
    status.Update(daemon_.client().apply("still", insert_all(world_)).status());
    if (!status.ok()) return status;
    ServerLoad server(daemon_, batches, 1, kWindow / 2);
    const size_t passes = passes_of_a_chunk(run_, [&](size_t) { server.run(1); });
    std::vector<absl::Status> failures(2);
    const auto beside = [&](size_t scene) {
      std::atomic<bool> over{false};
      std::thread mover([&] { failures[scene].Update(keep_moving(scene, over)); });
      server.run(passes);
      over = true;
      mover.join();
    };
    const auto count = static_cast<double>(batches.queries * passes * chunks());
    const std::vector<Contestant> contestants = {{"beside_durable", [&](size_t) { beside(0); }, count, {}},
                                                 {"beside_memory_acks", [&](size_t) { beside(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(kQueriesName, "ns/ball", hash_of_number(server.hashes().front())),
              run_.report);
    constexpr double kBar = 0.9;
    note_bar(run_.report, kBar);
    for (const absl::Status& failure : failures) status.Update(failure);
    status.Update(server.status());
    return status;
  }

 private:
  static constexpr size_t kBallsAMessage = 256;

  size_t chunks() const { return run_.options.quick ? 1 : 4; }

  // Sends one message of moves per millisecond until `over` is true.
  absl::Status keep_moving(size_t scene, const std::atomic<bool>& over) {
    std::vector<v1::StreamUpdatesRequest> one = {messages_[scene].front()};
    UpdateLoad load(daemon_, one, 1, UpdateLoad::Expect::kApplied);
    auto next = std::chrono::steady_clock::now();
    while (!over && load.status().ok()) {
      load.run(1);
      next += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(next);
    }
    return load.status();
  }

  // Verifies that both scenes give the same answers, and returns the hash of the answers.
  uint64_t compare(const std::string& name) const {
    uint64_t hashes[2] = {};
    for (size_t i = 0; i < 2; ++i) {
      const auto result = daemon_.client().query(kScenes[i], balls_around(world_, 1000));
      if (!result.ok()) run_.disagree(absl::StrCat(name, ": ", result.status().ToString()));
      if (result.ok()) hashes[i] = hash_of(*result);
    }
    if (hashes[0] != hashes[1]) run_.disagree(absl::StrCat(name, ": the two scenes differ"));
    return hashes[0];
  }

  const ServingRun& run_;
  const Daemon& daemon_;
  dynamic::World world_{dynamic::Kind::kUniform, kMoving};
  std::vector<std::vector<v1::StreamUpdatesRequest>> messages_;  // messages of moves for each scene
};

// The case restart: a scene whose log has a snapshot of all objects, followed by records of moves. The daemon is killed
// and started again several times.
class RestartCase {
 public:
  explicit RestartCase(const ServingRun& run) : run_(run) {}

  absl::Status measure() {
    run_.progress(kRestartName);
    if (absl::Status status = prepare(); !status.ok()) return status;
    std::vector<double> seconds, bar;
    uint64_t hash = 0;
    for (int round = 0; round <= run_.options.rounds; ++round) {
      const double start = wall_seconds();
      const auto daemon = Daemon::start({data_dir_option(folder_)});
      if (!daemon.ok()) return daemon.status();
      const auto result = (*daemon)->client().query("arena", balls_around(world_, 1));
      const double took = wall_seconds() - start;
      if (!result.ok()) return result.status();
      const auto all = (*daemon)->client().query("arena", balls_around(world_, 1000));
      if (!all.ok()) return all.status();
      hash = hash_of(*all);
      if (hash != expected_) run_.disagree(absl::StrCat(kRestartName, ": other answers after the restart"));
      kill((*daemon)->process().pid(), SIGKILL);
      if (round == 0) continue;
      seconds.push_back(took);
      bar.push_back(1);
    }
    add_cell(run_, cell_of(kRestartName, "s", hash_of_number(hash)), "bar", seconds, bar, Better::kLess);
    note_bar(run_.report, 1);
    return absl::OkStatus();
  }

 private:
  static constexpr size_t kRecords = 250;
  static constexpr size_t kMovesARecord = 4096;

  absl::Status prepare() {
    const auto daemon = Daemon::start({data_dir_option(folder_), "--snapshot-after=64KiB"});
    if (!daemon.ok()) return daemon.status();
    absl::Status status = create(**daemon, "arena", v1::DURABILITY_LOCAL);
    status.Update((*daemon)->client().apply("arena", insert_all(world_)).status());
    // Writes until the records of the log are larger than the scene, so that the daemon writes a new snapshot.
    const size_t ticks = run_.options.quick ? 40 : 4;
    uint64_t written = 1, kept = 0;
    for (size_t tick = 0; status.ok() && tick < ticks && kept == 0; ++tick) {
      status.Update(move(**daemon, std::numeric_limits<size_t>::max(), written));
      sleep_seconds(0.5);
      kept = last_of_snapshot(**daemon);
    }
    if (status.ok() && kept == 0) return absl::DataLossError("no snapshot was written");
    while (status.ok() && written < kept + kRecords) status.Update(move(**daemon, kept + kRecords - written, written));
    if (!status.ok()) return status;
    const auto result = (*daemon)->client().query("arena", balls_around(world_, 1000));
    if (!result.ok()) return result.status();
    expected_ = hash_of(*result);
    kill((*daemon)->process().pid(), SIGKILL);
    return status;
  }

  // Writes the records of one tick, at most the first `max_records` of them, and adds their number to `written`.
  absl::Status move(const Daemon& daemon, size_t max_records, uint64_t& written) {
    std::vector<v1::StreamUpdatesRequest> messages = move_messages(world_, "arena", kMovesARecord, 1);
    messages.resize(std::min(messages.size(), max_records));
    written += messages.size();
    UpdateLoad load(daemon, messages, kWindow, UpdateLoad::Expect::kApplied);
    load.run(1);
    return load.status();
  }

  // Returns the sequence number of the last record in the snapshot; 0 if there is no snapshot.
  static uint64_t last_of_snapshot(const Daemon& daemon) {
    const std::string log = daemon.log();
    const size_t line = log.rfind("snapshot written");
    const size_t number = line == std::string::npos ? line : log.find("sequence=", line);
    return number == std::string::npos ? 0 : std::strtoull(log.c_str() + number + 9, nullptr, 10);
  }

  const ServingRun& run_;
  TemporaryFolder folder_;
  dynamic::World world_{dynamic::Kind::kUniform, run_.options.quick ? 20'000u : 1'000'000u};
  uint64_t expected_ = 0;
};

}  // namespace

absl::Status run_durable_cases(const ServingRun& run) {
  absl::Status status;
  if (run.wants(kMovesName) || run.wants(kQueriesName)) {
    const TemporaryFolder folder;
    const auto daemon = Daemon::start({data_dir_option(folder)});
    if (!daemon.ok()) return daemon.status();
    DurableCases cases(run, **daemon);
    status = cases.fill();
    if (status.ok() && run.wants(kMovesName)) status = cases.moves();
    if (status.ok() && run.wants(kQueriesName)) status = cases.queries();
  }
  if (status.ok() && run.wants(kRestartName)) status = RestartCase(run).measure();
  return status;
}

}  // namespace locus::bench::serving
