#include "server/services/recovery.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/memory_log.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"

namespace locus::server {
namespace {

using test::expect_refused;
using test::MemoryLog;

constexpr char kServing[] = "\x08\x01";
constexpr char kNotServing[] = "\x08\x02";

// Log whose read_snapshot() blocks until let_go() is called.
class HeldLog final : public MemoryLog {
 public:
  explicit HeldLog(const Kept& kept) : MemoryLog(kept) {}

  void let_go() { held_ = false; }
  void wait_until_asked() const {
    while (!asked_) std::this_thread::yield();
  }
  absl::Status read_snapshot(SceneKey key, ChunkSink sink) const override {
    asked_ = true;
    while (held_) std::this_thread::yield();
    return failure_.ok() ? MemoryLog::read_snapshot(key, sink) : failure_;
  }
  void fail_reading(const absl::Status& failure) { failure_ = failure; }

 private:
  std::atomic<bool> held_{true};
  mutable std::atomic<bool> asked_{false};
  absl::Status failure_;
};

class RecoveryTest : public testing::Test {
 protected:
  ~RecoveryTest() override { std::remove(socket_.c_str()); }

  // Returns the contents of a log that stores one scene at revision 1.
  static MemoryLog::Kept kept_world() {
    MemoryLog log;
    Registry registry(&log);
    const absl::StatusOr<Registry::CreatedScene> created = registry.create_scene("world", {}, 5, "", false);
    EXPECT_TRUE(created.ok()) << created.status();
    const std::vector<uint64_t> ids = {1};
    const std::vector<float> position = {1, 2, 3};
    UpdateBatch batch;
    batch.inserts.emplace_back();
    batch.inserts[0].ids = ids;
    batch.inserts[0].positions = position;
    EXPECT_TRUE(created->scene->apply(batch).ok());
    return log.crash();
  }

  ServerConfig config() const {
    ServerConfig config = test::test_config();
    config.listen = {address_};
    return config;
  }
  void start(UpdateLog& log) {
    started_ = std::async(std::launch::async, [this, &log] { return Server::start(config(), &log, stop_); });
  }
  test::Stubs& stubs() {
    if (stubs_ == nullptr) stubs_ = std::make_unique<test::Stubs>(address_);
    return *stubs_;
  }
  grpc::Status get(v1::Scene* scene = nullptr) {
    grpc::ClientContext context;
    test::set_timeout(context);
    context.set_wait_for_ready(true);
    v1::GetSceneRequest request;
    request.set_name("world");
    v1::GetSceneResponse response;
    const grpc::Status status = stubs().scenes->GetScene(&context, request, &response);
    if (scene != nullptr) *scene = response.scene();
    return status;
  }
  grpc::Status query() {
    grpc::ClientContext context;
    test::set_timeout(context);
    v1::QueryRequest request;
    request.set_scene("world");
    v1::QueryResponse response;
    return stubs().queries->Query(&context, request, &response);
  }

  const std::string socket_ = testing::TempDir() + "locus-recovery-" + std::to_string(getpid()) + ".sock";
  const std::string address_ = "unix:" + socket_;
  std::atomic<bool> stop_{false};
  std::unique_ptr<test::Stubs> stubs_;
  std::future<absl::StatusOr<std::unique_ptr<Server>>> started_;
};

TEST_F(RecoveryTest, DuringRecoveryCallsAreRefusedAndHealthIsNotServing) {
  HeldLog log(kept_world());
  start(log);
  log.wait_until_asked();
  expect_refused(get(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_RECOVERING, ""});
  expect_refused(query(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_RECOVERING, ""});
  EXPECT_EQ(test::raw_call(stubs().channel, "/grpc.health.v1.Health/Check", "").bytes, kNotServing);
  log.let_go();
  const auto server = started_.get();
  ASSERT_TRUE(server.ok()) << server.status();
  v1::Scene scene;
  ASSERT_TRUE(get(&scene).ok());
  EXPECT_EQ(scene.revision(), 1u);
  EXPECT_EQ(scene.epoch(), 5u);
  EXPECT_TRUE(query().ok());
  EXPECT_EQ(test::raw_call(stubs().channel, "/grpc.health.v1.Health/Check", "").bytes, kServing);
}

TEST_F(RecoveryTest, AStopDuringRecoveryCancelsTheStart) {
  HeldLog log(kept_world());
  start(log);
  log.wait_until_asked();
  stop_ = true;
  log.let_go();
  EXPECT_EQ(started_.get().status().code(), absl::StatusCode::kCancelled);
}

TEST_F(RecoveryTest, ADiskThatCannotBeReadEndsTheStart) {
  HeldLog log(kept_world());
  log.fail_reading(absl::UnavailableError("the disk does not answer"));
  log.let_go();
  start(log);
  EXPECT_EQ(started_.get().status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(RecoveryTest, ADamagedSceneIsNamedAndCanBeDeleted) {
  HeldLog log(kept_world());
  log.fail_reading(absl::DataLossError("a chunk is gone"));
  log.let_go();
  start(log);
  const auto server = started_.get();
  ASSERT_TRUE(server.ok()) << server.status();
  expect_refused(get(), {grpc::StatusCode::DATA_LOSS, v1::REASON_DAMAGED, "scene"});
  expect_refused(query(), {grpc::StatusCode::DATA_LOSS, v1::REASON_DAMAGED, "scene"});
  grpc::ClientContext context;
  test::set_timeout(context);
  v1::DeleteSceneRequest request;
  request.set_name("world");
  v1::DeleteSceneResponse response;
  EXPECT_TRUE(stubs().scenes->DeleteScene(&context, request, &response).ok());
  EXPECT_EQ(get().error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace locus::server
