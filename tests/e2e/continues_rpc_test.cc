// Tests batches that a stream sends as several messages (UpdateBatch.continues): they become one revision or nothing.
#include "core/base/limits.h"
#include "core/base/sanitized_build.h"
#include "server/observability/process_figures.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/memory_log.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using UpdateStream = grpc::ClientReaderWriter<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>;

v1::UpdateBatch continuing(v1::UpdateBatch batch) {
  batch.set_continues(true);
  return batch;
}

v1::UpdateBatch removing(const std::vector<uint64_t>& ids) {
  v1::UpdateBatch batch;
  batch.mutable_remove_ids()->Add(ids.begin(), ids.end());
  return batch;
}

v1::UpdateBatch moving(uint64_t id, float x) {
  v1::UpdateBatch batch;
  v1::Move* move = batch.add_moves();
  move->add_ids(id);
  fill(move->mutable_positions(), {x, 0.f, 0.f});
  return batch;
}

const Refused kRestRefused{grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_MALFORMED, "continues"};

class ContinuesRpcTest : public RpcTest {
 protected:
  explicit ContinuesRpcTest(const server::ServerConfig& config = test_config()) : RpcTest(config) {}

  void SetUp() override {
    RpcTest::SetUp();
    open();
  }
  void TearDown() override {
    if (stream_ == nullptr) return;
    context_->TryCancel();
    stream_->Finish();
  }

  void open() {
    context_ = std::make_unique<grpc::ClientContext>();
    set_timeout(*context_);
    stream_ = stubs().updates->StreamUpdates(context_.get());
  }
  // Cancels the stream and waits until it has ended.
  void cut() {
    context_->TryCancel();
    EXPECT_FALSE(std::exchange(stream_, nullptr)->Finish().ok());
  }

  v1::StreamUpdatesResponse send(const v1::UpdateBatch& batch, const std::string& scene = "world") {
    v1::StreamUpdatesRequest request;
    request.set_scene(scene);
    request.set_sequence(++sequence_);
    *request.mutable_batch() = batch;
    v1::StreamUpdatesResponse response;
    EXPECT_TRUE(stream_->Write(request) && stream_->Read(&response));
    EXPECT_EQ(response.sequence(), sequence_);
    return response;
  }
  // Sends a message that must be held, and expects that its ack has `pending` and nothing else.
  void hold(const v1::UpdateBatch& batch) {
    const v1::StreamUpdatesResponse response = send(continuing(batch));
    v1::UpdateAck pending;
    pending.set_pending(true);
    EXPECT_EQ(response.ack().SerializeAsString(), pending.SerializeAsString()) << response.ShortDebugString();
  }
  v1::UpdateAck applied(const v1::UpdateBatch& batch) {
    const v1::StreamUpdatesResponse response = send(batch);
    EXPECT_TRUE(response.has_ack()) << response.ShortDebugString();
    return response.ack();
  }

  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<UpdateStream> stream_;
  uint64_t sequence_ = 0;
};

TEST_F(ContinuesRpcTest, NothingShowsUntilTheLastMessageAndThenAllOfIt) {
  ASSERT_TRUE(apply(insert_balls(1, 3)).ok());
  const std::string before = dump();
  hold(insert_balls(4, 6));
  hold(removing({1, 9}));
  hold(moving(4, 50));
  EXPECT_EQ(dump(), before);
  v1::UpdateBatch last = moving(2, 70);
  last.set_tick(12);
  const v1::UpdateAck ack = applied(last);
  EXPECT_EQ(ack.revision(), 2u);
  EXPECT_EQ(ack.tick(), 12u);
  EXPECT_EQ(ack.applied(), 6u);
  EXPECT_EQ(ack.refused(), 1u);
  ASSERT_EQ(ack.errors_size(), 1);
  EXPECT_EQ(ack.errors(0).message(), 1u);
  EXPECT_EQ(ack.errors(0).field(), "remove_ids");
  EXPECT_FALSE(ack.pending());
  EXPECT_EQ(get("world").objects(), 5u);
  EXPECT_EQ(get("world").revision(), 2u);
  EXPECT_EQ(applied(removing({4})).revision(), 3u);  // the next message is a batch of its own
}

TEST_F(ContinuesRpcTest, ARefusedMessageRefusesTheWholeRevision) {
  const std::string before = dump();
  v1::UpdateBatch wrong = continuing(insert_balls(4, 4));
  wrong.mutable_inserts(0)->add_positions(0);
  hold(insert_balls(1, 3));
  expect_error(send(wrong).error(),
               {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "inserts[0].positions"});
  expect_error(send(continuing(insert_balls(5, 5))).error(), kRestRefused);
  expect_error(send(insert_balls(6, 6)).error(), kRestRefused);
  EXPECT_EQ(dump(), before);
  EXPECT_EQ(applied(insert_balls(7, 7)).revision(), 1u);
  EXPECT_EQ(get("world").objects(), 1u);
}

TEST_F(ContinuesRpcTest, ARefusedLastMessageRefusesTheWholeRevision) {
  hold(insert_balls(1, 3));
  v1::UpdateBatch wrong = insert_balls(4, 4);
  wrong.mutable_inserts(0)->clear_ball();
  expect_error(send(wrong).error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "inserts[0].shape"});
  hold(insert_balls(1, 3));
  v1::UpdateBatch strict = removing({9});
  strict.set_all_or_nothing(true);
  expect_error(send(strict).error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_UNKNOWN_ID, "remove_ids", 0});
  hold(insert_balls(1, 3));
  v1::UpdateBatch gap = insert_balls(4, 4);
  gap.set_writer(5);
  gap.set_batch(7);
  expect_error(send(gap).error(), {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_BATCH_GAP, "batch"});
  EXPECT_EQ(get("world").revision(), 0u);
}

TEST_F(ContinuesRpcTest, AMessageThatIsRefusedBeforeItIsReadRefusesTheWholeRevision) {
  v1::UpdateBatch many;
  for (uint32_t i = 0; i <= limits::kMaxUpdateLists; ++i) many.add_relabels();
  const Refused limit{grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "relabels"};
  expect_error(send(continuing(many)).error(), limit);
  expect_error(send(insert_balls(6, 6)).error(), kRestRefused);
  hold(insert_balls(1, 3));
  expect_error(send(many).error(), limit);
  EXPECT_EQ(applied(insert_balls(7, 7)).revision(), 1u);
}

TEST_F(ContinuesRpcTest, OnlyTheLastMessageMayHaveSettings) {
  const auto refused = [this](void (*set)(v1::UpdateBatch&), const std::string& field) {
    v1::UpdateBatch batch = continuing(insert_balls(1, 1));
    set(batch);
    expect_error(send(batch).error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, field});
    expect_error(send(insert_balls(1, 1)).error(), kRestRefused);
  };
  refused([](v1::UpdateBatch& batch) { batch.set_tick(0); }, "tick");
  refused([](v1::UpdateBatch& batch) { batch.set_restart_ticks(true); }, "restart_ticks");
  refused([](v1::UpdateBatch& batch) { batch.set_all_or_nothing(true); }, "all_or_nothing");
  refused([](v1::UpdateBatch& batch) { batch.set_batch(1); }, "writer");
  refused(
      [](v1::UpdateBatch& batch) {
        batch.set_writer(4);
        batch.set_batch(1);
      },
      "writer");
  EXPECT_EQ(get("world").revision(), 0u);
}

TEST_F(ContinuesRpcTest, OtherCallsRefuseTheField) {
  const Refused malformed{grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "continues"};
  const v1::UpdateBatch batch = continuing(insert_balls(1, 1));
  expect_refused(apply(batch), malformed);
  v1::StepRequest step;
  step.set_scene("world");
  *step.mutable_update() = batch;
  *step.mutable_queries() = ray_along_x();
  v1::StepResponse stepped;
  expect_refused(call(*stubs().queries, &v1::QueryService::Stub::Step, step, &stepped), malformed);
  grpc::ClientContext context;
  set_timeout(context);
  const auto queries = stubs().queries->StreamQueries(&context);
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  *request.mutable_update() = batch;
  *request.mutable_batch() = ray_along_x();
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(queries->Write(request) && queries->Read(&response));
  expect_error(response.error(), malformed);
  queries->WritesDone();
  EXPECT_TRUE(queries->Finish().ok());
  EXPECT_EQ(get("world").revision(), 0u);
}

TEST_F(ContinuesRpcTest, AStreamThatEndsLeavesNothing) {
  hold(insert_balls(1, 3));
  cut();
  open();
  hold(insert_balls(4, 6));
  stream_->WritesDone();
  v1::StreamUpdatesResponse response;
  EXPECT_FALSE(stream_->Read(&response));
  EXPECT_TRUE(std::exchange(stream_, nullptr)->Finish().ok());
  open();
  EXPECT_EQ(applied(insert_balls(7, 7)).revision(), 1u);
  EXPECT_EQ(get("world").objects(), 1u);
}

TEST_F(ContinuesRpcTest, ADrainAmongTheMessagesLeavesNothing) {
  MemoryLog log;
  {
    RunningServer server(test_config(), &log);
    create_scene(server.stubs(), "world");
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = server.stubs().updates->StreamUpdates(&context);
    v1::StreamUpdatesRequest request;
    request.set_scene("world");
    v1::StreamUpdatesResponse response;
    *request.mutable_batch() = insert_balls(1, 2);
    ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
    EXPECT_EQ(response.ack().applied(), 2u);
    *request.mutable_batch() = continuing(insert_balls(3, 6));
    ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
    EXPECT_TRUE(response.ack().pending());
    server.server().drain(std::chrono::seconds(60));
    EXPECT_FALSE(stream->Read(&response));
    expect_refused(stream->Finish(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
  }
  MemoryLog kept(log.crash());
  RunningServer again(test_config(), &kept);
  EXPECT_EQ(get_scene(again.stubs(), "world").objects(), 2u);
  EXPECT_EQ(get_scene(again.stubs(), "world").revision(), 1u);
}

TEST_F(ContinuesRpcTest, ADeletedSceneLeavesNothingAlsoIfItIsCreatedAgain) {
  hold(insert_balls(1, 3));
  ASSERT_TRUE(remove("world").ok());
  expect_error(send(continuing(insert_balls(4, 4))).error(),
               {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  ASSERT_TRUE(create("world").ok());
  expect_error(send(insert_balls(5, 5)).error(), kRestRefused);
  hold(insert_balls(1, 3));
  ASSERT_TRUE(remove("world").ok());
  ASSERT_TRUE(create("world").ok());
  expect_error(send(insert_balls(5, 5)).error(), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  EXPECT_EQ(applied(insert_balls(7, 7)).revision(), 1u);
  EXPECT_EQ(get("world").objects(), 1u);
}

TEST_F(ContinuesRpcTest, AMessageThatNamesAnotherSceneRefusesTheWholeRevision) {
  hold(insert_balls(1, 3));
  expect_error(send(continuing(insert_balls(4, 4)), "other").error(),
               {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"});
  expect_error(send(insert_balls(5, 5)).error(), kRestRefused);
  EXPECT_EQ(get("world").revision(), 0u);
}

TEST_F(ContinuesRpcTest, MessagesThatAreSentAgainAreNotAppliedAgain) {
  v1::UpdateBatch last = removing({9});
  last.set_writer(77);
  last.set_batch(1);
  hold(insert_balls(1, 3));
  const v1::UpdateAck first = applied(last);
  hold(insert_balls(1, 3));
  v1::UpdateAck second = applied(last);
  EXPECT_TRUE(second.duplicate());
  second.set_duplicate(false);
  EXPECT_EQ(second.SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(get("world").revision(), 1u);
}

TEST_F(ContinuesRpcTest, AllMessagesTogetherKeepToTheLimits) {
  const std::vector<uint64_t> many(limits::kMaxUpdateItems / 2, 9);
  hold(removing(many));
  hold(removing(many));
  expect_error(send(removing({1})).error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "batch"});
  for (uint32_t i = 1; i < limits::kMaxUpdateMessages; ++i) hold({});
  EXPECT_EQ(applied(insert_balls(1, 1)).applied(), 1u);
  for (uint32_t i = 1; i < limits::kMaxUpdateMessages; ++i) hold({});
  v1::UpdateBatch one_too_many;
  one_too_many.set_continues(true);
  expect_error(send(one_too_many).error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "continues"});
  expect_error(send(insert_balls(2, 2)).error(),
               {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_MALFORMED, "continues"});
  EXPECT_EQ(get("world").objects(), 1u);
}

TEST_F(ContinuesRpcTest, StreamsDoNotMixTheirMessages) {
  hold(insert_balls(1, 3));
  ASSERT_TRUE(apply(insert_balls(10, 11)).ok());
  EXPECT_EQ(get("world").objects(), 2u);
  EXPECT_EQ(applied(moving(10, 4)).applied(), 4u);
  EXPECT_EQ(get("world").objects(), 5u);
}

// Server whose memory limit leaves 128 MiB free, of which one connection may hold half.
class ContinuesMemoryRpcTest : public ContinuesRpcTest {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = test_config();
    config.memory_limit = server::resident_bytes() + (uint64_t{128} << 20);
    return config;
  }
  ContinuesMemoryRpcTest() : ContinuesRpcTest(config()) {}
};

TEST_F(ContinuesMemoryRpcTest, HeldMessagesAreClaimedAsTheyArriveAndReleasedWithTheirRefusal) {
  if (kSanitizedBuild) GTEST_SKIP() << "the sanitizer's allocator keeps freed memory, which fills the small limit";
  for (int round = 0; round < 3; ++round) {
    v1::StreamUpdatesResponse response;
    int held = 0;
    while (held < 50 && !response.has_error()) {
      response = send(continuing(insert_balls(1, 20'000)));
      held += response.ack().pending() ? 1 : 0;
    }
    EXPECT_GT(held, 1) << round;
    EXPECT_LT(held, 50) << round;
    EXPECT_EQ(response.error().reason(), v1::REASON_LIMIT) << response.ShortDebugString();
    expect_error(send(insert_balls(5, 5)).error(), kRestRefused);
    hold(insert_balls(1, 20'000));
    cut();
    open();
  }
  hold(insert_balls(1, 20'000));
  EXPECT_EQ(applied(insert_balls(20'001, 20'010)).applied(), 20'010u);
}

class LatestWinsContinuesRpcTest : public ContinuesRpcTest {};

TEST_F(LatestWinsContinuesRpcTest, ABatchOfSeveralMessagesIsARevisionOfItsOwn) {
  v1::SceneSpec spec;
  spec.set_overload(v1::OVERLOAD_POLICY_LATEST_WINS);
  ASSERT_TRUE(remove("world").ok());
  ASSERT_TRUE(create("world", spec).ok());
  ASSERT_TRUE(apply(insert_balls(1, 3)).ok());
  for (int i = 0; i < 20; ++i) {
    hold(moving(1, static_cast<float>(i)));
    EXPECT_EQ(applied(moving(2, static_cast<float>(i))).revision(), 2u + static_cast<uint64_t>(i));
  }
}

// Tests UpdateBatch.expire_ticks over the protocol.
class ExpiryRpcTest : public RpcTest {
 protected:
  static v1::UpdateBatch expiring(uint64_t first, uint64_t last, const std::vector<uint64_t>& expire_ticks) {
    v1::UpdateBatch batch = insert_balls(first, last);
    batch.mutable_inserts(0)->mutable_expire_ticks()->Add(expire_ticks.begin(), expire_ticks.end());
    return batch;
  }
  static v1::UpdateBatch at(uint64_t tick, v1::UpdateBatch batch = {}) {
    batch.set_tick(tick);
    return batch;
  }
};

TEST_F(ExpiryRpcTest, ExpiredObjectsAreNotFoundAndADumpHasTheRemainingTicks) {
  ASSERT_TRUE(apply(at(10, expiring(1, 3, {5, 0, 9}))).ok());
  ASSERT_TRUE(apply(at(12)).ok());
  std::vector<v1::DumpSceneResponse> pieces;
  ASSERT_TRUE(dump("world", &pieces).ok());
  ASSERT_EQ(pieces.size(), 1u);
  ASSERT_EQ(pieces[0].objects_size(), 3);
  EXPECT_EQ(pieces[0].objects(0).expire_ticks(0), 3u);
  EXPECT_EQ(pieces[0].objects(1).expire_ticks_size(), 0);
  EXPECT_EQ(pieces[0].objects(2).expire_ticks(0), 7u);
  v1::UpdateBatch again;
  *again.mutable_inserts() = pieces[0].objects();
  ASSERT_TRUE(create("copy").ok());
  ASSERT_TRUE(apply(again, nullptr, "copy").ok());
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(at(3), &ack, "copy").ok());
  EXPECT_EQ(ack.applied() + ack.refused(), 0u);
  EXPECT_EQ(get("copy").objects(), 2u);
  ASSERT_TRUE(apply(at(15)).ok());
  EXPECT_EQ(get("world").objects(), 2u);
  ASSERT_TRUE(apply(at(100)).ok());
  EXPECT_EQ(get("world").objects(), 1u);
}

TEST_F(ExpiryRpcTest, WrongExpireTicksAreRefused) {
  expect_refused(apply(expiring(1, 3, {5, 6})),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "inserts[0].expire_ticks"});
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(expiring(1, 2, {(uint64_t{1} << 48) + 1, uint64_t{1} << 48}), &ack).ok());
  EXPECT_EQ(ack.applied(), 1u);
  ASSERT_EQ(ack.errors_size(), 1);
  EXPECT_EQ(ack.errors(0).field(), "inserts[0].expire_ticks");
  EXPECT_EQ(ack.errors(0).reason(), v1::REASON_OUT_OF_RANGE);
}

}  // namespace
}  // namespace locus::test
