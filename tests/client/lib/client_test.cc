#include "client/lib/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/query_builder.h"
#include "client/lib/status.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::HasSubstr;

ClientOptions quick() {
  ClientOptions options;
  options.retry = {.max_attempts = 4, .first_backoff = absl::Milliseconds(1), .max_backoff = absl::Milliseconds(4)};
  return options;
}

class ClientTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam(), quick());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
};

v1::QueryBatch one_ray() {
  QueryBuilder builder;
  builder.rays().ray({0, 0, 0}, {0, 0, 1});
  return builder.build();
}

TEST(ConnectTest, WithoutAServerTheErrorNamesTheAddressAndARemedy) {
  std::string address;
  {
    const FakeServer gone;
    address = gone.address();
  }
  const absl::Status status = Client::connect(address, quick()).status();
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("nothing answers at " + address));
  EXPECT_THAT(std::string(status.message()), HasSubstr("locusd"));
}

TEST(ConnectTest, WaitingForAServerEndsWithTheTimeout) {
  ClientOptions options = quick();
  options.wait_for_server = true;
  options.connect_timeout = absl::Milliseconds(50);
  const absl::Status status = Client::connect("unix:/nonexistent/locus.sock", options).status();
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("within 50ms"));
}

TEST(ConnectTest, AnEmptyAddressIsRefusedAtOnce) { EXPECT_TRUE(absl::IsInvalidArgument(Client::connect("").status())); }

TEST_P(ClientTest, QueriesAreRetriedWhileTheServerIsUnavailable) {
  server_.queries.failing_calls = 3;
  const absl::StatusOr<v1::QueryResult> result = client_->query("arena", one_ray());
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->revision(), 1u);
  EXPECT_EQ(server_.queries.calls, 4);
  EXPECT_EQ(server_.queries.scene, "arena") << "x-scene";
}

TEST_P(ClientTest, QueriesFailWhenTheAttemptsAreUsedUp) {
  server_.queries.failing_calls = 100;
  EXPECT_TRUE(absl::IsUnavailable(client_->query("arena", one_ray()).status()));
  EXPECT_EQ(server_.queries.calls, 4);
}

TEST_P(ClientTest, ALateQueryNamesTheRevisionForWhichItWaits) {
  server_.queries.delay = std::chrono::milliseconds(500);
  ClientOptions hasty = quick();
  hasty.deadline = absl::Milliseconds(100);
  const auto client = server_.connect(GetParam(), hasty);
  ASSERT_TRUE(client.ok()) << client.status();
  v1::QueryBatch batch = one_ray();
  const absl::Status late = (*client)->query("arena", batch).status();
  EXPECT_TRUE(absl::IsDeadlineExceeded(late));
  EXPECT_EQ(late.message(), "the query was not answered in time");
  EXPECT_TRUE(is_read_only(late));
  batch.mutable_view()->set_at_least(9);
  EXPECT_THAT(std::string((*client)->query("arena", batch).status().message()),
              HasSubstr("scene 'arena' may not have reached revision 9 yet"));
}

TEST_P(ClientTest, RefusalsAreNotRetriedAndKeepTheirFields) {
  server_.queries.failing_calls = 1;
  v1::Error error;
  error.set_reason(v1::REASON_NOT_FINITE);
  error.set_field("blocks[0].rays.origins");
  server_.queries.failure = testing::refusal(grpc::StatusCode::INVALID_ARGUMENT, "not finite", error);
  const absl::Status status = client_->query("arena", one_ray()).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  ASSERT_TRUE(error_of(status).has_value());
  EXPECT_EQ(error_of(status)->field(), "blocks[0].rays.origins");
  EXPECT_EQ(server_.queries.calls, 1);
}

TEST_P(ClientTest, ResourceExhaustedWithAHintIsRetried) {
  server_.queries.failing_calls = 1;
  v1::Error error;
  error.set_reason(v1::REASON_LIMIT);
  error.set_retry_after_ms(1);
  server_.queries.failure = testing::refusal(grpc::StatusCode::RESOURCE_EXHAUSTED, "full", error);
  EXPECT_TRUE(client_->query("arena", one_ray()).ok());
  EXPECT_EQ(server_.queries.calls, 2);
}

TEST_P(ClientTest, AnUpdateWithoutWriterIsSentOnce) {
  server_.updates.failing_calls = 1;
  EXPECT_TRUE(absl::IsUnavailable(client_->apply("arena", {}).status()));
  EXPECT_EQ(server_.updates.calls, 1);
}

TEST_P(ClientTest, AnUpdateWithWriterAndBatchIsRetried) {
  server_.updates.failing_calls = 2;
  v1::UpdateBatch batch;
  batch.set_writer(77);
  batch.set_batch(1);
  batch.set_tick(5);
  const absl::StatusOr<v1::UpdateAck> ack = client_->apply("arena", batch);
  ASSERT_TRUE(ack.ok()) << ack.status();
  EXPECT_EQ(server_.updates.calls, 3);
  EXPECT_THAT(server_.updates.applied(), ElementsAre(5));
}

TEST_P(ClientTest, ARefusalDoesNotHideThatAnEarlierAttemptMayHaveAppliedTheUpdate) {
  for (const bool is_step : {false, true}) {
    server_.updates.failing_calls = 1;
    server_.updates.refused_repeats = {5};
    v1::UpdateBatch batch;
    batch.set_writer(is_step ? 78 : 77);
    batch.set_batch(1);
    batch.set_tick(5);
    const absl::Status status =
        is_step ? client_->step("arena", batch, {}).status() : client_->apply("arena", batch).status();
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
    EXPECT_FALSE(refused_by_server(status)) << status;
    EXPECT_NE(status.message().find("may have been applied"), absl::string_view::npos) << status;
    EXPECT_TRUE(refused_by_server(client_->apply("arena", batch).status())) << "refused at the first attempt";
  }
}

TEST_P(ClientTest, AStepReturnsTheAckAndTheAnswerOrTheErrorOfItsQueries) {
  v1::QueryBatch queries;
  const absl::StatusOr<StepResult> step = client_->step("arena", {}, queries);
  ASSERT_TRUE(step.ok()) << step.status();
  EXPECT_EQ(step->ack.revision(), 1u);
  EXPECT_EQ(step->result->revision(), 1u);
  EXPECT_THAT(server_.updates.scenes, ElementsAre("arena")) << "x-scene";
  queries.set_max_work(testing::FakeQueries::kRefusedWork);
  const absl::StatusOr<StepResult> failed = client_->step("arena", {}, queries);
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(failed->ack.revision(), 2u);
  EXPECT_TRUE(absl::IsInvalidArgument(failed->result.status()));
  server_.updates.refused_ticks = {5};
  v1::UpdateBatch update;
  update.set_tick(5);
  EXPECT_TRUE(absl::IsInvalidArgument(client_->step("arena", update, {}).status()));
}

TEST_P(ClientTest, OnlyAStepWithWriterAndBatchIsRetried) {
  server_.updates.failing_calls = 1;
  EXPECT_TRUE(absl::IsUnavailable(client_->step("arena", {}, {}).status()));
  EXPECT_EQ(server_.updates.calls, 1);
  server_.updates.failing_calls = 2;
  v1::UpdateBatch update;
  update.set_writer(77);
  update.set_batch(1);
  EXPECT_TRUE(client_->step("arena", update, {}).ok());
  EXPECT_EQ(server_.updates.calls, 4);
}

TEST_P(ClientTest, OtherChangesAreNeverRetried) {
  server_.scenes.failing_creates = 1;
  v1::CreateSceneRequest request;
  request.set_name("arena");
  EXPECT_TRUE(absl::IsUnavailable(client_->create_scene(request).status()));
  EXPECT_EQ(server_.scenes.creates, 1);
}

TEST_P(ClientTest, ASceneIsCreatedFoundListedAndDeleted) {
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    v1::CreateSceneRequest request;
    request.set_name(name);
    ASSERT_TRUE(client_->create_scene(request).ok());
  }
  EXPECT_EQ(client_->get_scene("c")->name(), "c");
  const absl::StatusOr<std::vector<v1::Scene>> scenes = client_->list_scenes();
  ASSERT_TRUE(scenes.ok());
  ASSERT_EQ(scenes->size(), 5u) << "three pages";
  EXPECT_EQ(scenes->back().name(), "e");
  v1::DeleteSceneRequest gone;
  gone.set_name("c");
  EXPECT_TRUE(client_->delete_scene(gone).ok());
  EXPECT_TRUE(absl::IsNotFound(client_->get_scene("c").status()));
}

TEST_P(ClientTest, ASceneNameThatIsIllegalInMetadataReachesTheServerAndIsRefusedThere) {
  EXPECT_TRUE(absl::IsNotFound(client_->get_scene("no\nsuch\x01name").status()));
}

TEST_P(ClientTest, HealthIsServingAndAnUnknownServiceIsNotFound) {
  const absl::StatusOr<Health> health = client_->health();
  ASSERT_TRUE(health.ok()) << health.status();
  EXPECT_EQ(*health, Health::kServing);
  EXPECT_TRUE(absl::IsNotFound(client_->health("no.such.Service").status()));
}

TEST_P(ClientTest, QuotasAreReadPageByPage) {
  EXPECT_EQ(client_->get_quotas()->size(), 1u);
  v1::GetQuotasRequest request;
  request.set_all(true);
  const absl::StatusOr<std::vector<v1::IdentityQuotas>> all = client_->get_quotas(request);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ(all->back().identity(), "token:b");
  EXPECT_FALSE(all->back().quotas(1).has_limit());
}

TEST_P(ClientTest, AStoppedServerIsUnavailable) {
  server_.stop();
  EXPECT_TRUE(absl::IsUnavailable(client_->get_server().status()));
}

TEST_P(ClientTest, ADumpEndsEarlyWithTheErrorOfItsCallback) {
  int pieces = 0;
  v1::DumpSceneRequest request;
  request.set_scene("arena");
  EXPECT_TRUE(client_
                  ->dump(request,
                         [&](const v1::DumpSceneResponse&) {
                           ++pieces;
                           return absl::OkStatus();
                         })
                  .ok());
  EXPECT_EQ(pieces, 3);
  EXPECT_EQ(client_->dump(request, [](const v1::DumpSceneResponse&) { return absl::AbortedError("enough"); }),
            absl::AbortedError("enough"));
}

TEST_P(ClientTest, AMeshArrivesCompleteInMessagesOfAtMostOneMebibyte) {
  std::vector<float> vertices(900'000);
  for (size_t i = 0; i < vertices.size(); ++i) vertices[i] = static_cast<float>(i);
  std::vector<uint32_t> indices(600'000);
  for (size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<uint32_t>(i % 300'000);
  uint64_t reported = 0;
  const absl::StatusOr<v1::UploadMeshResponse> uploaded = client_->upload_mesh(
      {.name = "level", .vertices = vertices, .indices = indices}, [&](uint64_t sent, uint64_t) { reported = sent; });
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  EXPECT_FALSE(uploaded->already_known());
  EXPECT_EQ(server_.scenes.vertices, vertices);
  EXPECT_EQ(server_.scenes.indices, indices);
  EXPECT_LE(server_.scenes.largest_message, size_t{1} << 20);
  EXPECT_EQ(reported, (vertices.size() + indices.size()) * 4);
}

TEST_P(ClientTest, AKnownMeshIsNotSentAgain) {
  const std::vector<float> vertices(30'000'000, 1.0f);
  const std::vector<uint32_t> indices = {0, 1, 2};
  const Sha256 hash = mesh_sha256(vertices, indices);
  server_.scenes.known_hashes.insert(std::string(hash.begin(), hash.end()));
  uint64_t sent = 0;
  const absl::StatusOr<v1::UploadMeshResponse> uploaded = client_->upload_mesh(
      {.name = "level", .vertices = vertices, .indices = indices}, [&](uint64_t bytes, uint64_t) { sent = bytes; });
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  EXPECT_TRUE(uploaded->already_known());
  // An in-process channel drops the messages that are written after the answer, without an error.
  if (GetParam() == testing::Way::kLoopback) {
    EXPECT_LT(sent, vertices.size() * 4) << "the upload continues although the server has answered";
  }
}

TEST_P(ClientTest, AMeshWithIncompleteTriplesIsNotSent) {
  const std::vector<float> vertices(10);
  EXPECT_TRUE(absl::IsInvalidArgument(client_->upload_mesh({.name = "level", .vertices = vertices}).status()));
}

INSTANTIATE_TEST_SUITE_P(Ways, ClientTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
