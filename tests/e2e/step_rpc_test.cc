// Steps: an update and queries in one message, as a unary call and on a stream of queries.
#include <chrono>
#include <future>
#include <limits>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "tests/support/kept_daemon.h"
#include "tests/support/memory_log.h"
#include "tests/support/random.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using QueryStream = grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;

v1::QueryBatch lookup(uint64_t id) {
  v1::QueryBatch batch;
  v1::QueryBlock* block = batch.add_blocks();
  block->add_columns(v1::COLUMN_ID);
  block->add_columns(v1::COLUMN_POSE);
  block->mutable_lookup()->add_ids(id);
  return batch;
}

v1::UpdateBatch move_to(uint64_t id, double x) {
  v1::UpdateBatch batch;
  v1::Move* move = batch.add_moves();
  move->add_ids(id);
  fill(move->mutable_positions_f64(), {x, 0.0, 0.0});
  return batch;
}

v1::UpdateBatch wrong_lengths() {
  v1::UpdateBatch batch = insert_balls(7, 7);
  batch.mutable_inserts(0)->add_positions(0);
  return batch;
}

// A batch whose queries fail only when they run: their time is outside of the history.
v1::QueryBatch ray_of_the_past() {
  v1::QueryBatch batch = ray_along_x();
  batch.mutable_blocks(0)->add_as_of_ticks(3);
  return batch;
}

class StepRpcTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(apply(insert_balls(1, 5)).ok());
  }

  grpc::Status step(const v1::UpdateBatch& update, const v1::QueryBatch& queries, v1::StepResponse* response,
                    const std::string& scene = "world") {
    v1::StepRequest request;
    request.set_scene(scene);
    *request.mutable_update() = update;
    *request.mutable_queries() = queries;
    return call(*stubs().queries, &v1::QueryService::Stub::Step, request, response);
  }

  // Makes a step in both forms, a unary call and a message of a stream. Expects that it is refused as a whole.
  void expect_refused_whole(const v1::UpdateBatch& update, const v1::QueryBatch& queries, const Refused& expected) {
    const std::string before = dump();
    v1::StepResponse response;
    expect_refused(step(update, queries, &response), expected);
    const v1::StreamQueriesResponse answer = streamed(message(1, queries, update));
    expect_error(answer.error(), expected);
    EXPECT_FALSE(answer.has_ack());
    EXPECT_EQ(dump(), before);
  }

  void create_scene(RunningServer& server) {
    v1::CreateSceneRequest create;
    create.set_name("world");
    v1::CreateSceneResponse created;
    ASSERT_TRUE(call(*server.stubs().scenes, &v1::SceneService::Stub::CreateScene, create, &created).ok());
  }

  static v1::StreamQueriesRequest message(uint64_t sequence, const v1::QueryBatch& queries,
                                          const std::optional<v1::UpdateBatch>& update = std::nullopt) {
    v1::StreamQueriesRequest request;
    request.set_scene("world");
    request.set_sequence(sequence);
    *request.mutable_batch() = queries;
    if (update) *request.mutable_update() = *update;
    return request;
  }
  // Returns the answer to the only message of a stream.
  v1::StreamQueriesResponse streamed(const v1::StreamQueriesRequest& request) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = stubs().queries->StreamQueries(&context);
    v1::StreamQueriesResponse response;
    EXPECT_TRUE(stream->Write(request));
    EXPECT_TRUE(stream->Read(&response));
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
    return response;
  }
};

TEST_F(StepRpcTest, TheQueriesSeeTheUpdateOfTheirStep) {
  for (int i = 1; i <= 20; ++i) {
    v1::StepResponse response;
    ASSERT_TRUE(step(move_to(2, 100.0 + i), lookup(2), &response).ok());
    EXPECT_EQ(response.ack().applied(), 1u);
    EXPECT_EQ(response.ack().revision(), get("world").revision());
    EXPECT_EQ(response.result().revision(), response.ack().revision());
    EXPECT_EQ(response.result().epoch(), response.ack().epoch());
    EXPECT_EQ(response.result().blocks(0).positions(0), 100.0 + i);
  }
}

TEST_F(StepRpcTest, AStepWithoutPartsReportsTheRevision) {
  v1::StepResponse response;
  ASSERT_TRUE(step({}, {}, &response).ok());
  EXPECT_EQ(response.ack().revision(), 1u);
  EXPECT_EQ(response.result().revision(), 1u);
  const v1::StreamQueriesResponse answer = streamed(message(1, {}, v1::UpdateBatch()));
  EXPECT_EQ(answer.ack().revision(), 1u);
  EXPECT_EQ(answer.result().revision(), 1u);
}

TEST_F(StepRpcTest, ARefusedItemIsListedAndTheQueriesSeeTheOthers) {
  v1::UpdateBatch update = move_to(2, 50);
  *update.add_moves() = move_to(99, 60).moves(0);
  v1::StepResponse response;
  ASSERT_TRUE(step(update, lookup(2), &response).ok());
  EXPECT_EQ(response.ack().applied(), 1u);
  EXPECT_EQ(response.ack().refused(), 1u);
  ASSERT_EQ(response.ack().errors_size(), 1);
  EXPECT_EQ(response.ack().errors(0).reason(), v1::REASON_UNKNOWN_ID);
  EXPECT_EQ(response.result().blocks(0).positions(0), 50);
}

TEST_F(StepRpcTest, ARefusedUpdateRefusesTheWholeStep) {
  const auto invalid = grpc::StatusCode::INVALID_ARGUMENT;
  expect_refused_whole(wrong_lengths(), lookup(2), {invalid, v1::REASON_COLUMN_LENGTH, "inserts[0].positions"});
  v1::UpdateBatch all = move_to(99, 1);
  all.set_all_or_nothing(true);
  expect_refused_whole(all, lookup(2), {invalid, v1::REASON_UNKNOWN_ID, "moves[0].ids", 0});
  v1::UpdateBatch frame = move_to(2, 1);
  frame.mutable_frame()->set_x(2e9);
  expect_refused_whole(frame, lookup(2), {invalid, v1::REASON_OUT_OF_RANGE, "frame"});
  v1::UpdateBatch gap = move_to(2, 1);
  gap.set_writer(77);
  gap.set_batch(2);
  expect_refused_whole(gap, lookup(2), {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_BATCH_GAP, "batch"});
  gap.clear_batch();
  expect_refused_whole(gap, lookup(2), {invalid, v1::REASON_MALFORMED, "batch"});
}

TEST_F(StepRpcTest, WrongQueriesAreRefusedBeforeTheUpdateIsApplied) {
  const auto invalid = grpc::StatusCode::INVALID_ARGUMENT;
  v1::QueryBatch wrong = ray_along_x();
  wrong.mutable_blocks(0)->mutable_rays()->set_directions(0, std::numeric_limits<float>::quiet_NaN());
  expect_refused_whole(move_to(2, 50), wrong, {invalid, v1::REASON_NOT_FINITE, "blocks[0].rays.directions", 0});
  wrong = ray_along_x();
  wrong.add_blocks();
  expect_refused_whole(move_to(2, 50), wrong, {invalid, v1::REASON_MALFORMED, "blocks[1]"});
}

TEST_F(StepRpcTest, AViewThatCannotContainTheUpdateIsRefused) {
  v1::QueryBatch queries = lookup(2);
  queries.mutable_view()->set_exactly(1);
  expect_refused_whole(move_to(2, 50), queries,
                       {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "view.exactly"});
  queries.mutable_view()->clear_exactly();
  queries.mutable_view()->set_epoch(12345);
  expect_refused_whole(move_to(2, 50), queries,
                       {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_SCENE_RESTARTED, "view.epoch"});
}

TEST_F(StepRpcTest, ANameThatNoSceneHasIsNotFound) {
  v1::StepResponse response;
  expect_refused(step(move_to(2, 1), lookup(2), &response, "other"),
                 {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  expect_refused(step(move_to(2, 1), lookup(2), &response, "Not A Name"),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"});
}

TEST_F(StepRpcTest, QueriesThatFailAfterTheUpdateAreAnsweredWithItsAck) {
  v1::StepResponse response;
  ASSERT_TRUE(step(move_to(2, 50), ray_of_the_past(), &response).ok());
  EXPECT_EQ(response.ack().applied(), 1u);
  EXPECT_FALSE(response.has_result());
  EXPECT_EQ(response.error().code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(response.error().reason(), v1::REASON_OUT_OF_RANGE);
  const v1::StreamQueriesResponse answer = streamed(message(4, ray_of_the_past(), move_to(2, 60)));
  EXPECT_EQ(answer.sequence(), 4u);
  EXPECT_EQ(answer.ack().applied(), 1u);
  EXPECT_EQ(answer.error().code(), grpc::StatusCode::OUT_OF_RANGE);
  v1::QueryResult result;
  ASSERT_TRUE(query(lookup(2), &result).ok());
  EXPECT_EQ(result.blocks(0).positions(0), 60);
}

TEST_F(StepRpcTest, ARepeatedBatchIsAppliedOnceAndItsQueriesRunAgain) {
  v1::UpdateBatch update = move_to(2, 50);
  update.set_writer(77);
  update.set_batch(1);
  v1::StepResponse first, second;
  ASSERT_TRUE(step(update, lookup(2), &first).ok());
  ASSERT_TRUE(apply(move_to(2, 70)).ok());
  ASSERT_TRUE(step(update, lookup(2), &second).ok());
  EXPECT_TRUE(second.ack().duplicate());
  EXPECT_EQ(second.ack().revision(), first.ack().revision());
  EXPECT_EQ(second.result().revision(), first.ack().revision() + 1);
  EXPECT_EQ(second.result().blocks(0).positions(0), 70);
}

TEST_F(StepRpcTest, AViewMayAskForALaterRevisionThanTheUpdates) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  v1::QueryBatch later = lookup(2);
  later.mutable_view()->set_at_least(3);
  ASSERT_TRUE(stream->Write(message(1, later, move_to(2, 50))));
  ASSERT_TRUE(stream->Write(message(2, lookup(2), move_to(2, 60))));
  std::map<uint64_t, v1::StreamQueriesResponse> answers;
  v1::StreamQueriesResponse response;
  while (answers.size() < 2 && stream->Read(&response)) answers[response.sequence()] = response;
  EXPECT_EQ(answers[1].ack().revision(), 2u);
  EXPECT_EQ(answers[1].result().revision(), 3u);
  EXPECT_EQ(answers[1].result().blocks(0).positions(0), 60);
  EXPECT_EQ(answers[2].ack().revision(), 3u);
  later.mutable_view()->set_at_least(99);
  ASSERT_TRUE(stream->Write(message(3, later, move_to(2, 70))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.ack().revision(), 4u);
  EXPECT_EQ(response.error().code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StepRpcTest, AStreamMixesStepsAndQueriesAndOnlyStepsHaveAcks) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  v1::StreamQueriesResponse response;
  const auto answer_to = [&](const v1::StreamQueriesRequest& request) {
    EXPECT_TRUE(stream->Write(request));
    EXPECT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.sequence(), request.sequence());
  };
  for (uint64_t i = 0; i < 40; i += 5) {
    answer_to(message(i, lookup(2), move_to(2, 10.0 + static_cast<double>(i))));
    EXPECT_EQ(response.ack().applied(), 1u);
    EXPECT_EQ(response.result().blocks(0).positions(0), 10.0 + static_cast<double>(i));
    answer_to(message(i + 1, lookup(2)));
    EXPECT_FALSE(response.has_ack());
    EXPECT_TRUE(response.has_result());
    answer_to(message(i + 2, lookup(2), wrong_lengths()));
    EXPECT_FALSE(response.has_ack());
    EXPECT_EQ(response.error().reason(), v1::REASON_COLUMN_LENGTH);
    answer_to(message(i + 3, lookup(2), move_to(99, 1)));
    EXPECT_EQ(response.ack().refused(), 1u);
    v1::StreamQueriesRequest elsewhere = message(i + 4, lookup(2), move_to(2, 1));
    elsewhere.set_scene("other");
    answer_to(elsewhere);
    EXPECT_FALSE(response.has_ack());
    EXPECT_EQ(response.error().reason(), v1::REASON_MALFORMED);
  }
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StepRpcTest, StepsOfAStreamAreAppliedInTheirOrder) {
  constexpr uint64_t kSteps = 300;
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  std::thread writer([&stream] {
    for (uint64_t i = 1; i <= kSteps; ++i) {
      v1::UpdateBatch update = insert_balls(100 + i, 100 + i);
      update.set_writer(5);
      update.set_batch(i);
      EXPECT_TRUE(stream->Write(message(i, lookup(100 + i), update)));
    }
    stream->WritesDone();
  });
  uint64_t answers = 0;
  v1::StreamQueriesResponse response;
  while (stream->Read(&response)) {
    ++answers;
    ASSERT_TRUE(response.has_result()) << response.error().message();
    EXPECT_EQ(response.ack().revision(), 1 + response.sequence());
    EXPECT_GE(response.result().revision(), response.ack().revision());
    EXPECT_EQ(response.result().blocks(0).ids(0), 100 + response.sequence());
  }
  writer.join();
  EXPECT_EQ(answers, kSteps);
  EXPECT_TRUE(stream->Finish().ok());
}

// Random steps of several streams and unary calls at once, each with objects of its own, some of them wrong: every
// query sees the latest position that its own writer has an ack for, and every step is answered.
TEST_F(StepRpcTest, EveryQuerySeesAtLeastTheUpdatesOfItsOwnSteps) {
  constexpr int kWriters = 4, kSteps = 150;
  const auto run = [this](uint64_t writer) {
    Random random(600 + writer);
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = stubs().queries->StreamQueries(&context);
    std::map<uint64_t, double> positions;
    uint64_t revision = 0;
    for (int i = 0; i < kSteps; ++i) {
      const uint64_t id = writer * 1'000 + static_cast<uint64_t>(random.below(5)) + 1;
      const double x = random.whole(-1'000, 1'000);
      v1::UpdateBatch update;
      const bool is_wrong = random.below(5) == 0;
      if (positions.contains(id)) {
        update = move_to(id, x);
      } else {
        update = insert_balls(id, id);
        update.mutable_inserts(0)->clear_positions();
        fill(update.mutable_inserts(0)->mutable_positions_f64(), {x, 0.0, 0.0});
      }
      if (is_wrong) *update.mutable_moves()->Add() = v1::Move();
      if (is_wrong) update.mutable_moves()->rbegin()->add_positions(1);
      v1::StepResponse answer;
      if (random.below(2) == 0) {
        const grpc::Status status = step(update, lookup(id), &answer);
        ASSERT_EQ(status.ok(), !is_wrong) << status.error_message();
      } else {
        v1::StreamQueriesResponse response;
        ASSERT_TRUE(stream->Write(message(static_cast<uint64_t>(i), lookup(id), update)));
        ASSERT_TRUE(stream->Read(&response));
        ASSERT_EQ(response.has_ack(), !is_wrong) << response.error().message();
        *answer.mutable_ack() = response.ack();
        *answer.mutable_result() = response.result();
      }
      if (is_wrong) continue;
      positions[id] = x;
      EXPECT_GT(answer.ack().revision(), revision);
      EXPECT_GE(answer.result().revision(), answer.ack().revision());
      revision = answer.ack().revision();
      ASSERT_EQ(answer.result().blocks(0).ids(0), id);
      EXPECT_EQ(answer.result().blocks(0).positions(0), x);
    }
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  };
  std::vector<std::thread> threads;
  for (uint64_t writer = 1; writer <= kWriters; ++writer) threads.emplace_back(run, writer);
  for (std::thread& thread : threads) thread.join();
}

TEST_F(StepRpcTest, ADrainEndsTheWaitForALaterRevisionWithTheAck) {
  std::promise<v1::StepResponse> answered;
  std::thread caller([&] {
    v1::QueryBatch later = lookup(2);
    later.mutable_view()->set_at_least(99);
    v1::StepResponse response;
    const grpc::Status status = step(move_to(2, 50), later, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    answered.set_value(response);
  });
  while (get("world").revision() < 2) {
  }
  running_.server().drain(std::chrono::seconds(10));
  const v1::StepResponse response = answered.get_future().get();
  caller.join();
  EXPECT_EQ(response.ack().revision(), 2u);
  EXPECT_EQ(response.error().code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

// A drain without a grace period ends the step while its queries wait. If the call is answered, the answer has the ack;
// otherwise its outcome is unknown. It is never REASON_DRAINING, which would mean that nothing was changed.
TEST_F(StepRpcTest, TheEndOfADrainDoesNotHideAnAppliedUpdate) {
  for (int times = 0; times < 5; ++times) {
    RunningServer server(test_config());
    create_scene(server);
    std::thread caller([&] {
      v1::StepRequest request;
      request.set_scene("world");
      *request.mutable_update() = insert_balls(1, 1);
      request.mutable_queries()->mutable_view()->set_at_least(99);
      v1::StepResponse response;
      const grpc::Status status = call(*server.stubs().queries, &v1::QueryService::Stub::Step, request, &response);
      if (status.ok()) {
        EXPECT_EQ(response.ack().revision(), 1u);
        EXPECT_EQ(response.error().code(), grpc::StatusCode::DEADLINE_EXCEEDED);
      } else if (!status.error_details().empty()) {  // none: gRPC cancelled all calls
        EXPECT_EQ(error_of(status).reason(), v1::REASON_UNSPECIFIED) << status.error_message();
      }
    });
    v1::GetSceneRequest get;
    get.set_name("world");
    v1::GetSceneResponse scene;
    while (scene.scene().revision() < 1)
      ASSERT_TRUE(call(*server.stubs().scenes, &v1::SceneService::Stub::GetScene, get, &scene).ok());
    server.server().drain(std::chrono::milliseconds(0));
    caller.join();
  }
}

// The caller gives up while the update waits for the log. Then nothing waits for the later revision.
TEST_F(StepRpcTest, AStepWhoseCallerGaveUpDuringItsUpdateDoesNotWaitForARevision) {
  MemoryLog log;
  RunningServer durable(test_config(), &log);
  v1::CreateSceneRequest create;
  create.set_name("world");
  create.mutable_spec()->set_durability(v1::DURABILITY_LOCAL);
  v1::CreateSceneResponse created;
  ASSERT_TRUE(call(*durable.stubs().scenes, &v1::SceneService::Stub::CreateScene, create, &created).ok());
  const auto calls = [&] {
    v1::GetServerResponse server;
    EXPECT_TRUE(
        call(*durable.stubs().server, &v1::ServerService::Stub::GetServer, v1::GetServerRequest(), &server).ok());
    for (const v1::Limit& limit : server.limits())
      if (limit.name() == "calls") return limit.used();
    return -1.0;
  };
  log.hold();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
  std::thread caller([&] {
    v1::StepRequest request;
    request.set_scene("world");
    *request.mutable_update() = insert_balls(1, 1);
    request.mutable_queries()->mutable_view()->set_at_least(99);
    v1::StepResponse response;
    EXPECT_EQ(durable.stubs().queries->Step(&context, request, &response).error_code(), grpc::StatusCode::CANCELLED);
  });
  log.wait_for_writer();
  EXPECT_EQ(calls(), 2) << "the step, and the call that asks";
  context.TryCancel();
  caller.join();
  calls();  // follows the cancellation on the same connection
  log.release();
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (calls() != 1 && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_EQ(calls(), 1) << "the step still waits";
}

// The updates wait for the log, or for a thread of the update queue because they scan all objects.
TEST_F(StepRpcTest, QueriesSeeAnUpdateThatTheUpdateQueueApplies) {
  MemoryLog log;
  RunningServer durable(test_config(), &log);
  v1::CreateSceneRequest create;
  create.set_name("world");
  create.mutable_spec()->set_durability(v1::DURABILITY_LOCAL);
  v1::CreateSceneResponse created;
  ASSERT_TRUE(call(*durable.stubs().scenes, &v1::SceneService::Stub::CreateScene, create, &created).ok());
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = durable.stubs().queries->StreamQueries(&context);
  for (uint64_t i = 1; i <= 20; ++i) {
    v1::UpdateBatch anew = insert_balls(i, i);
    anew.set_clear(true);
    v1::StreamQueriesResponse answer;
    ASSERT_TRUE(stream->Write(message(i, lookup(i), anew)));
    ASSERT_TRUE(stream->Read(&answer));
    EXPECT_EQ(answer.result().blocks(0).ids(0), i) << answer.error().message();
    EXPECT_EQ(answer.result().revision(), answer.ack().revision());
    v1::StepRequest request;
    request.set_scene("world");
    *request.mutable_update() = move_to(i, 200.0);
    *request.mutable_queries() = lookup(i);
    v1::StepResponse response;
    ASSERT_TRUE(call(*durable.stubs().queries, &v1::QueryService::Stub::Step, request, &response).ok());
    EXPECT_EQ(response.result().blocks(0).positions(0), 200.0);
    EXPECT_EQ(response.ack().revision(), answer.ack().revision() + 1);
  }
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StepRpcTest, AStepOnADeletedSceneIsRefusedAndTheStreamServesTheNextScene) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  const auto send = [&](uint64_t sequence, const v1::UpdateBatch& update) {
    v1::StreamQueriesResponse response;
    EXPECT_TRUE(stream->Write(message(sequence, lookup(1), update)) && stream->Read(&response));
    EXPECT_EQ(response.sequence(), sequence);
    return response;
  };
  EXPECT_EQ(send(1, move_to(1, 50)).ack().revision(), 2u);
  ASSERT_TRUE(remove("world").ok());
  const Refused not_found{grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"};
  const v1::StreamQueriesResponse refused = send(2, move_to(1, 60));
  expect_error(refused.error(), not_found);
  EXPECT_FALSE(refused.has_ack());
  v1::StepResponse response;
  expect_refused(step(move_to(1, 60), lookup(1), &response), not_found);
  ASSERT_TRUE(create("world").ok());
  EXPECT_EQ(send(3, insert_balls(1, 1)).ack().revision(), 1u);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

// The update of the step is applied before the scene is deleted, so its ack is in the answer.
TEST_F(StepRpcTest, ADeletionOfTheSceneEndsTheWaitForALaterRevisionWithTheAck) {
  std::thread caller([&] {
    v1::QueryBatch later = lookup(2);
    later.mutable_view()->set_at_least(99);
    v1::StepResponse response;
    const grpc::Status status = step(move_to(2, 50), later, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.ack().revision(), 2u);
    EXPECT_EQ(response.error().code(), grpc::StatusCode::NOT_FOUND) << response.ShortDebugString();
  });
  while (get("world").revision() < 2) {
  }
  EXPECT_TRUE(remove("world").ok());
  caller.join();
}

// The updates of the steps wait for the log, and become one revision.
TEST_F(StepRpcTest, StepsWhoseUpdatesBecomeOneRevisionSeeTheirUpdates) {
  constexpr uint64_t kSteps = 10;
  MemoryLog log;
  RunningServer durable(test_config(), &log);
  v1::SceneSpec spec;
  spec.set_durability(v1::DURABILITY_LOCAL);
  spec.set_overload(v1::OVERLOAD_POLICY_LATEST_WINS);
  test::create_scene(durable.stubs(), "world", spec);
  const auto step_on = [&](const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
    v1::StepRequest request;
    request.set_scene("world");
    *request.mutable_update() = update;
    *request.mutable_queries() = queries;
    v1::StepResponse response;
    const grpc::Status status = call(*durable.stubs().queries, &v1::QueryService::Stub::Step, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  const auto waiting = [&] {
    v1::GetServerResponse server;
    EXPECT_TRUE(
        call(*durable.stubs().server, &v1::ServerService::Stub::GetServer, v1::GetServerRequest(), &server).ok());
    for (const v1::Limit& limit : server.limits())
      if (limit.name() == "waiting_updates") return limit.used();
    return -1.0;
  };
  EXPECT_EQ(step_on(insert_balls(1, kSteps), {}).ack().revision(), 1u);
  log.hold();
  std::thread first([&] { EXPECT_EQ(step_on(move_to(1, 7), {}).ack().revision(), 2u); });
  log.wait_for_writer();
  std::vector<std::thread> callers;
  for (uint64_t id = 1; id <= kSteps; ++id)
    callers.emplace_back([&, id] {
      const v1::StepResponse response = step_on(move_to(id, 100.0 + static_cast<double>(id)), lookup(id));
      EXPECT_EQ(response.ack().revision(), 3u);
      EXPECT_EQ(response.ack().applied(), 1u);
      EXPECT_EQ(response.result().revision(), 3u);
      ASSERT_EQ(response.result().blocks_size(), 1) << response.ShortDebugString();
      EXPECT_EQ(response.result().blocks(0).positions(0), 100.0 + static_cast<double>(id));
    });
  while (waiting() < static_cast<double>(kSteps)) std::this_thread::yield();
  log.release();
  first.join();
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(get_scene(durable.stubs(), "world").revision(), 3u);
}

}  // namespace
}  // namespace locus::test
