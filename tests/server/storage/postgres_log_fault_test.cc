// Tests of an engine that fails, of daemons that lead the same scene, and of damaged rows. No acknowledged record is
// lost or stored twice, and no refused one is stored.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/storage/postgres_log.h"
#include "tests/support/log_fixture.h"
#include "tests/support/postgres_server.h"
#include "tests/support/stored_model.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::append_records;
using test::create_scene;
using test::open_and_lead;
using test::PostgresServer;
using test::record_difference;
using test::write_snapshot;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kEndSessions =
    "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'locusd'";

class PostgresLogFaultTest : public test::LogFixture {
 protected:
  void SetUp() override {
    if (!PostgresServer::installed()) GTEST_SKIP() << PostgresServer::kMissing;
    engine_ = std::make_unique<PostgresServer>();
    open();
  }
  void open() {
    log_ = nullptr;
    log_ = open_and_lead(engine_->options());
    ASSERT_NE(log_, nullptr);
  }
  std::unique_ptr<PostgresLog> open_another() const {
    auto log = PostgresLog::open(engine_->options());
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }
  void sql(const std::string& statement) { ASSERT_THAT(engine_->query(statement), Not(HasSubstr("ERROR"))); }

  std::unique_ptr<PostgresServer> engine_;
};

TEST_F(PostgresLogFaultTest, AFormerLeaderCanChangeNothing) {
  const SceneKey taken = create("taken", 1), kept = create("kept", 2);
  append(taken, 3);
  const auto other = open_another();
  const auto scene = other->take_over(taken, 1);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->last_sequence, 3u);
  EXPECT_EQ(scene->epoch, 7u);
  EXPECT_EQ(other->leader_of(taken)->token, 2u);
  EXPECT_EQ(append_records(*log_, taken, 7, 1).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(append_records(*log_, taken, 7, 1).code(), absl::StatusCode::kAborted) << "it stays fenced";
  EXPECT_EQ(write_snapshot(*log_, taken, 2).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(log_->set_scene_spec(taken, "another").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(log_->restart_scene(taken, 8).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(log_->delete_scene(taken).code(), absl::StatusCode::kAborted);
  append(kept, 2);
  ASSERT_EQ(append_records(*other, taken, 7, 2), absl::OkStatus());
  uint64_t last = 0;
  EXPECT_EQ(record_difference(*other, taken, 1, last), "");
  EXPECT_EQ(last, 5u);
}

// A snapshot takes long; what is changed meanwhile must not be overwritten by the row that it read first.
TEST_F(PostgresLogFaultTest, ASnapshotKeepsASpecificationThatChangedMeanwhile) {
  const SceneKey scene = create("a", 1);
  append(scene, 3);
  const std::vector<std::string> chunks = test::snapshot_chunks(scene, 3);
  size_t next = 0;
  const auto state = [&]() -> absl::StatusOr<std::optional<std::string>> {
    if (next == 1) {
      EXPECT_EQ(log_->set_scene_spec(scene, "changed meanwhile"), absl::OkStatus());
    }
    if (next == chunks.size()) return std::nullopt;
    return chunks[next++];
  };
  ASSERT_EQ(log_->write_snapshot(scene, 3, state), absl::OkStatus());
  open();
  EXPECT_EQ(test::find_stored(*log_, "a")->spec, "changed meanwhile");
  expect_snapshot(scene, 3);
}

TEST_F(PostgresLogFaultTest, OneOfTwoThatTakeOverAtOnceSucceeds) {
  const SceneKey scene = create("a", 1);
  const auto other = open_another();
  EXPECT_TRUE(other->take_over(scene, 1).ok());
  EXPECT_EQ(open_another()->take_over(scene, 1).status().code(), absl::StatusCode::kAborted);
  EXPECT_TRUE(other->take_over(scene, 1).ok()) << "the same takeover again, as after a lost answer";
  EXPECT_EQ(other->leader_of(scene)->token, 2u);
  EXPECT_EQ(other->take_over(77, 1).status().code(), absl::StatusCode::kNotFound);
}

// Lets two daemons take one scene from each other as fast as they can. Each appends a record that names its token.
// Returns a description of a record that was accepted twice, lost, or written under an older token; empty if none.
std::string race(PostgresServer& engine, uint64_t rounds) {
  auto creator = PostgresLog::open(engine.options());
  const SceneKey scene = create_scene(**creator, "raced", 1).value();
  std::vector<std::vector<std::pair<uint64_t, uint64_t>>> accepted(2);  // sequence number and token of each ack
  std::atomic<uint64_t> failures = 0;
  std::vector<std::thread> writers;
  for (auto& acks : accepted)
    writers.emplace_back([&acks, &failures, &engine, scene, rounds] {
      auto log = PostgresLog::open(engine.options());
      for (uint64_t round = 0; round < rounds; ++round) {
        const uint64_t token = (*log)->leader_of(scene)->token;
        const auto taken = (*log)->take_over(scene, token);
        if (!taken.ok() && !absl::IsAborted(taken.status())) ++failures;
        if (!taken.ok()) continue;
        const std::string bytes = absl::StrCat(token + 1);
        const LogEntry entry = test::entry_of(7, 0, bytes);
        const auto last = (*log)->append(scene, {&entry, 1}, AckLevel::kLocal);
        if (last.ok()) acks.emplace_back(*last, token + 1);
        if (!last.ok() && !absl::IsAborted(last.status())) ++failures;
      }
    });
  for (std::thread& writer : writers) writer.join();
  if (failures > 0) return absl::StrCat(failures.load(), " calls failed");
  std::map<uint64_t, uint64_t> acks;
  for (const auto& own : accepted)
    for (const auto& [sequence, token] : own)
      if (!acks.emplace(sequence, token).second) return absl::StrCat("record ", sequence, " was accepted twice");
  uint64_t last_token = 0, found = 0;
  std::string fault;
  const absl::Status read = (*creator)->read(scene, 1, [&](const LogRecord& record) {
    ++found;
    const auto ack = acks.find(record.sequence);
    if (ack == acks.end() || absl::StrCat(ack->second) != record.entry.bytes)
      fault = absl::StrCat("record ", record.sequence, " is not the one that was accepted");
    if (ack != acks.end() && ack->second < last_token) fault = absl::StrCat("token before record ", record.sequence);
    if (ack != acks.end()) last_token = ack->second;
    return absl::OkStatus();
  });
  if (!read.ok()) return std::string(read.message());
  if (found != acks.size()) return absl::StrCat(found, " records of ", acks.size(), " accepted");
  if (acks.size() < rounds / 10) return absl::StrCat("only ", acks.size(), " records were accepted");
  return fault;
}

TEST_F(PostgresLogFaultTest, TwoWritersThatRaceAreNeverBothAccepted) { EXPECT_EQ(race(*engine_, 200), ""); }

class LongPostgresLogFaultTest : public PostgresLogFaultTest {};

TEST_F(LongPostgresLogFaultTest, TwoWritersThatRaceAreNeverBothAccepted) { EXPECT_EQ(race(*engine_, 10'000), ""); }

// Appends to several scenes at once while `disturb` runs. Every append must succeed in the end, and each scene must
// have exactly the records that were acknowledged.
void expect_exact_while(UpdateLog& log, const std::function<void()>& disturb) {
  constexpr SceneKey kScenes = 4;
  for (SceneKey scene = 1; scene <= kScenes; ++scene)
    ASSERT_TRUE(create_scene(log, absl::StrCat("scene", scene), scene).ok());
  std::atomic<bool> ended = false;
  std::vector<uint64_t> acknowledged(kScenes + 1);
  std::vector<std::thread> threads;
  for (SceneKey scene = 1; scene <= kScenes; ++scene)
    threads.emplace_back([&, scene] {
      while (!ended) {
        const absl::Status status = append_records(log, scene, 7, 1);
        EXPECT_EQ(status, absl::OkStatus());
        if (!status.ok()) return;
        ++acknowledged[scene];
      }
    });
  disturb();
  ended = true;
  for (std::thread& thread : threads) thread.join();
  for (SceneKey scene = 1; scene <= kScenes; ++scene) {
    uint64_t last = 0;
    EXPECT_EQ(record_difference(log, scene, 1, last), "");
    EXPECT_EQ(last, acknowledged[scene]);
    EXPECT_GT(last, 0u);
  }
}

TEST_F(PostgresLogFaultTest, AnAppendWhoseAnswerIsLostIsFoundOut) {
  expect_exact_while(*log_, [this] {
    for (int i = 0; i < 60; ++i) {
      sql(kEndSessions);
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
  });
}

// Another daemon may hang while it has the lock of a scene.
TEST_F(PostgresLogFaultTest, ALockedSceneDelaysNoOtherScene) {
  constexpr SceneKey kScenes = 24;
  for (SceneKey scene = 1; scene <= kScenes; ++scene) create(absl::StrCat("scene", scene), scene);
  std::atomic<bool> ended = false;
  std::atomic<uint64_t> delayed = 0;
  std::vector<std::thread> threads;
  for (SceneKey scene = 1; scene <= kScenes; ++scene)
    threads.emplace_back([&, scene] {
      while (!ended) {
        const auto begin = std::chrono::steady_clock::now();
        EXPECT_EQ(append_records(*log_, scene, 7, 1), absl::OkStatus());
        if (scene != 5 && std::chrono::steady_clock::now() - begin > std::chrono::seconds(1)) ++delayed;
        if (scene == 5) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(
      engine_->query("BEGIN; SELECT FROM locus.scene_log WHERE scene = 5 FOR UPDATE; SELECT pg_sleep(2.5); COMMIT"),
      "");
  EXPECT_EQ(delayed, 0u);
  ended = true;
  for (std::thread& thread : threads) thread.join();
  uint64_t last = 0;
  for (SceneKey scene = 1; scene <= kScenes; ++scene) EXPECT_EQ(record_difference(*log_, scene, 1, last), "");
}

// A scene that stays locked is refused in time, and the record is not stored.
TEST_F(PostgresLogFaultTest, ASceneThatStaysLockedIsRefusedInTime) {
  const SceneKey scene = create("a", 1);
  log_ = nullptr;
  PostgresOptions options = engine_->options();
  options.append_wait = std::chrono::milliseconds(700);
  log_ = open_and_lead(options);
  std::thread locker([&] {
    engine_->query("BEGIN; SELECT FROM locus.scene_log WHERE scene = 1 FOR UPDATE; SELECT pg_sleep(3); COMMIT");
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kUnavailable);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  locker.join();
  ASSERT_EQ(append_records(*log_, scene, 7, 1), absl::OkStatus());
  expect_records(scene, 1, 1);
}

TEST_F(PostgresLogFaultTest, AKilledServerLosesNothingAndAppendsContinue) {
  expect_exact_while(*log_, [this] {
    for (int i = 0; i < 3; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      engine_->restart(SIGKILL);
    }
  });
  open();
  for (SceneKey scene = 1; scene <= 4; ++scene) {
    uint64_t last = 0;
    EXPECT_EQ(record_difference(*log_, scene, 1, last), "");
    EXPECT_EQ(append_records(*log_, scene, 7, 1), absl::OkStatus());
  }
}

TEST_F(PostgresLogFaultTest, AfterRandomLossesOfConnectionsEveryAcknowledgedChangeIsThere) {
  for (const uint64_t seed : {1, 2}) {
    engine_ = std::make_unique<PostgresServer>();
    open();
    test::StoredModel model;
    test::Random random(seed);
    std::atomic<bool> ended = false;
    std::thread disturber([&] {
      while (!ended) {
        engine_->query(kEndSessions);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
    for (int i = 0; i < 300; ++i) model.step(*log_, random);
    ended = true;
    disturber.join();
    EXPECT_GT(model.acknowledged(), 100u);
    log_ = nullptr;
    open();
    EXPECT_EQ(model.difference(*log_, test::Refusals::kNone), "") << "seed " << seed;
  }
}

TEST_F(PostgresLogFaultTest, AnEngineThatIsAwayRefusesByNameAndNothingIsStoredLater) {
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  log_ = nullptr;
  PostgresOptions options = engine_->options();
  options.append_wait = std::chrono::milliseconds(500);
  log_ = open_and_lead(options);
  engine_->stop(SIGKILL);
  const absl::Status away = append_records(*log_, scene, 7, 1);
  EXPECT_EQ(away.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(away.message()), HasSubstr("engine"));
  EXPECT_EQ(log_->latest(scene).value(), 2u);
  engine_->start();
  ASSERT_EQ(append_records(*log_, scene, 7, 1), absl::OkStatus());
  expect_records(scene, 1, 3);
}

// The engine waits for a standby that does not exist, so it takes statements and never answers.
TEST_F(PostgresLogFaultTest, AnAppendThatTheEngineNeverAnsweredIsRemovedBeforeTheNext) {
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  log_ = nullptr;
  PostgresOptions options = engine_->options();
  options.answer_wait = std::chrono::milliseconds(200);
  options.append_wait = std::chrono::milliseconds(800);
  std::vector<std::string> tokens;
  options.on_token = [&](SceneKey of, uint64_t before, uint64_t now) {
    tokens.push_back(absl::StrCat(of, ":", before, "->", now, " at ", log_->latest(of).value()));
  };
  options.on_fenced = [](SceneKey, uint64_t) { ADD_FAILURE() << "this daemon still leads"; };
  log_ = open_and_lead(options);
  sql("ALTER SYSTEM SET synchronous_standby_names = 'nobody'");
  sql("SELECT pg_reload_conf()");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const std::string bytes = "of the lost one";
  const LogEntry lost[] = {test::entry_of(7, 3, bytes), test::entry_of(7, 4, bytes)};
  EXPECT_EQ(log_->append(scene, lost, AckLevel::kLocal).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(log_->latest(scene).value(), 2u);
  // The end of the wait lets the engine commit the lost append, which must not come back.
  sql("ALTER SYSTEM RESET synchronous_standby_names");
  sql("SELECT pg_reload_conf()");
  for (int i = 0; i < 500 && engine_->query("SELECT last FROM locus.scene_log") != "4"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(engine_->query("SELECT last FROM locus.scene_log"), "4") << "the engine has committed it by now";
  EXPECT_TRUE(tokens.empty());
  ASSERT_EQ(append_records(*log_, scene, 7, 3), absl::OkStatus());
  EXPECT_EQ(tokens, std::vector<std::string>{"1:2->3 at 2"}) << "reported before the next record is written";
  expect_records(scene, 1, 5);
}

// If an operator cancels the wait for the standbys, PostgreSQL reports the commit as successful, with a warning.
TEST_F(PostgresLogFaultTest, ACommitWhoseWaitWasCancelledIsNotAcknowledged) {
  const SceneKey scene = create("a", 1);
  log_ = nullptr;
  PostgresOptions options = engine_->options();
  options.append_wait = std::chrono::milliseconds(1'500);
  log_ = open_and_lead(options);
  sql("ALTER SYSTEM SET synchronous_standby_names = 'nobody'");
  sql("SELECT pg_reload_conf()");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  std::atomic<bool> ended = false;
  std::atomic<int> cancelled = 0;
  std::thread canceller([&] {
    while (!ended) {
      cancelled += engine_->query(
                       "SELECT count(pg_cancel_backend(pid)) FROM pg_stat_activity"
                       " WHERE application_name = 'locusd' AND wait_event = 'SyncRep'") != "0";
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  EXPECT_EQ(append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kUnavailable);
  ended = true;
  canceller.join();
  EXPECT_GT(cancelled, 0);
  EXPECT_EQ(log_->latest(scene).value(), 0u);
}

// After its standby was promoted, the old primary still accepts connections and statements, but commits nothing.
TEST_F(PostgresLogFaultTest, AppendsFollowThePromotedStandby) {
  log_ = nullptr;
  engine_ = std::make_unique<PostgresServer>(PostgresServer::Settings{"synchronous_standby_names=two"});
  PostgresServer second(*engine_, "two");
  PostgresOptions options = engine_->options({&second});
  options.replication = EngineReplication::kStorage;  // the promoted server has no standby of its own
  options.answer_wait = std::chrono::milliseconds(500);
  log_ = open_and_lead(options);
  ASSERT_NE(log_, nullptr);
  expect_exact_while(*log_, [&second] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    // The standby may refuse a connection on a busy machine, or take long to be promoted.
    for (int i = 0; i < 600 && second.query("SELECT pg_is_in_recovery()") != "f"; ++i) {
      second.query("SELECT pg_promote(false)");
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    std::this_thread::sleep_for(std::chrono::seconds(3));
  });
  for (SceneKey scene = 1; scene <= 4; ++scene)
    EXPECT_EQ(second.query(absl::StrCat("SELECT last FROM locus.scene_log WHERE scene = ", scene)),
              absl::StrCat(log_->latest(scene).value()));
}

// After a restart, a primary whose standby is away shows a commit that only its own disk has.
TEST_F(PostgresLogFaultTest, AnAppendThatNoStandbyHasIsNotAcknowledged) {
  log_ = nullptr;
  engine_ = std::make_unique<PostgresServer>(PostgresServer::Settings{"synchronous_standby_names=two"});
  PostgresServer second(*engine_, "two");
  PostgresOptions options = engine_->options({&second});
  options.append_wait = std::chrono::seconds(6);
  log_ = open_and_lead(options);
  ASSERT_NE(log_, nullptr);
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  second.stop(SIGKILL);
  absl::Status status;
  std::thread appender([&] { status = append_records(*log_, scene, 7, 1); });
  std::this_thread::sleep_for(std::chrono::seconds(1));
  engine_->restart(SIGKILL);
  EXPECT_EQ(engine_->query("SELECT last FROM locus.scene_log"), "3") << "a plain read shows what no standby has";
  appender.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  second.start();
  ASSERT_EQ(append_records(*log_, scene, 7, 2), absl::OkStatus());
  expect_records(scene, 1, 4);
}

TEST_F(PostgresLogFaultTest, AnEngineThatMayLoseAcknowledgedRecordsIsRefused) {
  const auto refusal_with = [&](const std::string& setting, const std::string& value, EngineReplication replication) {
    sql(absl::StrCat("ALTER SYSTEM SET ", setting, " = '", value, "'"));
    sql("SELECT pg_reload_conf()");
    for (int i = 0; i < 500 && engine_->query(absl::StrCat("SHOW ", setting)) != value; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    PostgresOptions options = engine_->options();
    options.replication = replication;
    const absl::Status status = PostgresLog::open(options).status();
    sql(absl::StrCat("ALTER SYSTEM RESET ", setting));
    sql("SELECT pg_reload_conf()");
    EXPECT_EQ(status.code(), status.ok() ? absl::StatusCode::kOk : absl::StatusCode::kFailedPrecondition) << status;
    return std::string(status.message());
  };
  using enum EngineReplication;
  EXPECT_THAT(refusal_with("fsync", "off", kStorage), HasSubstr("fsync"));
  EXPECT_THAT(refusal_with("full_page_writes", "off", kStorage), HasSubstr("full_page_writes"));
  EXPECT_THAT(refusal_with("synchronous_commit", "off", kStorage), HasSubstr("synchronous_commit"));
  EXPECT_EQ(refusal_with("synchronous_commit", "local", kStorage), "");
  EXPECT_THAT(refusal_with("synchronous_commit", "local", kStandbys), HasSubstr("synchronous_commit"));
  EXPECT_THAT(refusal_with("synchronous_commit", "remote_write", kStandbys), HasSubstr("synchronous_commit"));
  EXPECT_THAT(refusal_with("synchronous_commit", "on", kStandbys), HasSubstr("synchronous_standby_names"));
  sql("CREATE DATABASE latin TEMPLATE template0 ENCODING 'LATIN1' LOCALE 'C'");
  PostgresOptions latin = engine_->options();
  latin.url.replace(latin.url.find("/postgres?"), 10, "/latin?");
  EXPECT_THAT(std::string(PostgresLog::open(latin).status().message()), HasSubstr("LATIN1"));
}

TEST_F(PostgresLogFaultTest, AppendsStopWhenAnOperatorSwitchesReplicationOff) {
  log_ = nullptr;
  engine_ = std::make_unique<PostgresServer>(PostgresServer::Settings{});
  sql("ALTER SYSTEM SET synchronous_standby_names = 'two'");
  sql("SELECT pg_reload_conf()");
  PostgresServer second(*engine_, "two");
  PostgresOptions options = engine_->options({&second});
  options.append_wait = std::chrono::milliseconds(1'500);
  log_ = open_and_lead(options);
  ASSERT_NE(log_, nullptr);
  std::vector<SceneKey> scenes;
  for (const char* const name : {"a", "b", "c", "d"}) scenes.push_back(create(name, scenes.size() + 1));
  second.stop(SIGKILL);  // from now on no append may be acknowledged
  std::atomic<int> acknowledged = 0;
  std::vector<std::thread> threads;
  for (const SceneKey scene : scenes)
    threads.emplace_back([&, scene] {
      for (int i = 0; i < 3; ++i) acknowledged += append_records(*log_, scene, 7, 1).ok() ? 1 : 0;
    });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  sql("ALTER SYSTEM SET synchronous_standby_names = ''");
  sql("SELECT pg_reload_conf()");
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(acknowledged, 0);
  const absl::Status status = append_records(*log_, scenes[0], 7, 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("synchronous_standby_names"));
}

TEST_F(PostgresLogFaultTest, TablesOfANewerFormatAreRefused) {
  sql("UPDATE locus.format SET number = 2");
  const absl::Status status = PostgresLog::open(engine_->options()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("format 2"));
}

TEST_F(PostgresLogFaultTest, SeveralDaemonsMayCreateTheTablesAtOnce) {
  engine_ = std::make_unique<PostgresServer>();
  std::vector<std::thread> threads;
  std::atomic<int> opened = 0;
  for (int i = 0; i < 6; ++i)
    threads.emplace_back([&] { opened += PostgresLog::open(engine_->options()).ok() ? 1 : 0; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(opened, 6);
  EXPECT_EQ(engine_->query("SELECT count(*) FROM locus.format"), "1");
}

// Scenes and a mesh, of which a test damages one row.
class PostgresLogDamageTest : public PostgresLogFaultTest {
 protected:
  void SetUp() override {
    PostgresLogFaultTest::SetUp();
    if (IsSkipped()) return;
    damaged_ = create("damaged", 1);
    intact_ = create("intact", 2);
    append(damaged_, 6);
    append(intact_, 6);
    ASSERT_EQ(add_mesh("mesh", 1, {"content of the mesh"}), absl::OkStatus());
  }
  void expect_damage(const std::string& statement, const std::function<absl::Status(UpdateLog&)>& read,
                     const std::string& name) {
    sql(statement);
    open();
    const absl::Status status = read(*log_);
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << statement << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(name));
    expect_records(intact_, 1, 6);
    expect_snapshot(intact_, 0);
  }
  absl::Status read_records(UpdateLog& log) const {
    return log.read(damaged_, 1, [](const LogRecord&) { return absl::OkStatus(); });
  }

  SceneKey damaged_ = 0, intact_ = 0;
};

TEST_F(PostgresLogDamageTest, AFlippedByteOfARecordIsFound) {
  expect_damage(
      "UPDATE locus.record SET bytes = set_byte(bytes, 0, 255 - get_byte(bytes, 0)) WHERE scene = 1 AND sequence = 4",
      [this](UpdateLog& log) { return read_records(log); }, "'damaged'");
}
TEST_F(PostgresLogDamageTest, AChangedWriterOfARecordIsFound) {
  expect_damage(
      "UPDATE locus.record SET writer = writer + 1 WHERE scene = 1 AND sequence = 4",
      [this](UpdateLog& log) { return read_records(log); }, "'damaged'");
}
TEST_F(PostgresLogDamageTest, AMissingRecordIsFound) {
  expect_damage(
      "DELETE FROM locus.record WHERE scene = 1 AND sequence = 3", [this](UpdateLog& log) { return read_records(log); },
      "'damaged'");
}
TEST_F(PostgresLogDamageTest, AMissingLastRecordIsFound) {
  expect_damage(
      "DELETE FROM locus.record WHERE scene = 1 AND sequence = 6", [this](UpdateLog& log) { return read_records(log); },
      "'damaged'");
}
TEST_F(PostgresLogDamageTest, ARecordOfAnotherSceneIsFound) {
  expect_damage(
      "UPDATE locus.record a SET bytes = b.bytes, chain = b.chain, writer = b.writer, batch = b.batch"
      " FROM locus.record b WHERE a.scene = 1 AND b.scene = 2 AND a.sequence = 6 AND b.sequence = 6",
      [this](UpdateLog& log) { return read_records(log); }, "'damaged'");
}
TEST_F(PostgresLogDamageTest, AFlippedByteOfASnapshotIsFound) {
  expect_damage(
      "UPDATE locus.snapshot_chunk SET bytes = set_byte(bytes, 0, 255 - get_byte(bytes, 0))"
      " WHERE scene = 1 AND number = 1",
      [this](UpdateLog& log) { return test::read_snapshot(log, damaged_).status(); }, "'damaged'");
}
TEST_F(PostgresLogDamageTest, AMissingChunkOfASnapshotIsFound) {
  expect_damage(
      "DELETE FROM locus.snapshot_chunk WHERE scene = 1 AND number = 2",
      [this](UpdateLog& log) { return test::read_snapshot(log, damaged_).status(); }, "'damaged'");
}
TEST_F(PostgresLogDamageTest, AChangedRowOfASceneIsFoundAndTheSceneCanBeDeleted) {
  expect_damage(
      "UPDATE locus.scene SET epoch = epoch + 1 WHERE key = 1",
      [](UpdateLog& log) { return test::find_stored(log, "damaged")->damage; }, "'damaged'");
  EXPECT_EQ(append_records(*log_, damaged_, 7, 1).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(log_->delete_scene(damaged_), absl::OkStatus());
  open();
  EXPECT_EQ(test::find_stored(*log_, "damaged"), nullptr);
}
TEST_F(PostgresLogDamageTest, AFlippedByteOfAMeshIsFoundAndTheContentCanBeStoredAgain) {
  expect_damage(
      "UPDATE locus.mesh_chunk SET bytes = set_byte(bytes, 3, 255 - get_byte(bytes, 3))"
      " WHERE content = (SELECT content FROM locus.mesh_content)",
      [](UpdateLog& log) { return test::read_mesh(log, test::hash_of(1)).status(); }, "mesh");
  ASSERT_EQ(add_mesh("again", 1, {"content of the mesh"}), absl::OkStatus());
  EXPECT_EQ(test::read_mesh(*log_, test::hash_of(1)).value(), std::vector<std::string>{"content of the mesh"});
}
TEST_F(PostgresLogDamageTest, AChangedRowOfAMeshIsFound) {
  expect_damage(
      "UPDATE locus.mesh SET grace_s = 77", [](UpdateLog& log) { return log.stored_meshes()[0].damage; }, "'mesh'");
}

}  // namespace
}  // namespace locus::server
