// Streams of a server with access control that lose a right, and the audit of ends of leases.
#include <gmock/gmock.h>

#include <string>

#include "tests/support/access_fixture.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using AccessStreamsRpcTest = AccessRpcTest;

TEST_F(AccessStreamsRpcTest, ARevokedRightLeavesNothingOfARevisionOfSeveralMessages) {
  for (const char* const access : {"grant token:updater read arena-*\ngrant token:admin admin *\n",
                                   "grant token:updater admin lobby-*\ngrant token:admin admin *\n"}) {
    write("access", kAccess);
    running_->server().reload();
    grpc::ClientContext context;
    set_timeout(context);
    context.AddMetadata("authorization", "Bearer " + tokens_["updater"]);
    const auto stream = running_->stubs().updates->StreamUpdates(&context);
    v1::StreamUpdatesRequest request;
    request.set_scene("arena-1");
    *request.mutable_batch() = insert_balls(1, 3);
    request.mutable_batch()->set_continues(true);
    v1::StreamUpdatesResponse response;
    ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
    EXPECT_TRUE(response.ack().pending());
    write("access", access);
    running_->server().reload();
    EXPECT_FALSE(stream->Read(&response));
    const grpc::StatusCode code = stream->Finish().error_code();
    EXPECT_TRUE(code == grpc::StatusCode::PERMISSION_DENIED || code == grpc::StatusCode::NOT_FOUND) << code;
    v1::GetSceneResponse scene;
    ASSERT_TRUE(scene.ParseFromString(call("/locus.v1.SceneService/GetScene", "admin").bytes));
    EXPECT_EQ(scene.scene().objects(), 0u);
    EXPECT_EQ(scene.scene().revision(), 0u);
  }
}

TEST_F(AccessStreamsRpcTest, AStepOfAStreamThatLostTheRightToUpdateIsRefusedAndItsQueriesGoOn) {
  grpc::ClientContext context;
  set_timeout(context);
  context.AddMetadata("authorization", "Bearer " + tokens_["updater"]);
  const auto stream = running_->stubs().queries->StreamQueries(&context);
  const auto send = [&](const v1::StreamQueriesRequest& request) {
    v1::StreamQueriesResponse response;
    EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
    return response;
  };
  v1::StreamQueriesRequest query;
  query.set_scene("arena-1");
  *query.mutable_batch() = ray_along_x();
  v1::StreamQueriesRequest step = query;
  *step.mutable_update() = insert_balls(1, 3);
  EXPECT_EQ(send(step).ack().applied(), 3u);
  write("access", "grant token:updater read arena-*\n");
  running_->server().reload();
  *step.mutable_update() = insert_balls(4, 6);
  const v1::StreamQueriesResponse refused = send(step);
  EXPECT_EQ(refused.error().code(), grpc::StatusCode::PERMISSION_DENIED) << refused.ShortDebugString();
  EXPECT_FALSE(refused.has_ack());
  EXPECT_FALSE(refused.has_result());
  EXPECT_EQ(send(query).result().revision(), 1u);
  write("access", kAccess);
  running_->server().reload();
  EXPECT_EQ(send(step).ack().revision(), 2u);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(AccessStreamsRpcTest, EndsOfLeasesAreAuditedAsUpdatesOfTheServer) {
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  *update.mutable_batch() = insert_balls(1, 3);
  update.mutable_batch()->set_writer(7);
  update.mutable_batch()->set_batch(1);
  update.mutable_batch()->set_lease_ms(20);
  ASSERT_TRUE(raw_call(running_->stubs().channel, "/locus.v1.UpdateService/ApplyUpdates", update.SerializeAsString(),
                       kCallTimeout, tokens_["updater"])
                  .status.ok());
  v1::GetSceneResponse scene;
  while (scene.scene().revision() < 2)
    ASSERT_TRUE(scene.ParseFromString(call("/locus.v1.SceneService/GetScene", "admin").bytes));
  EXPECT_EQ(scene.scene().objects(), 0u);
  running_.reset();  // writes the queued lines
  const std::string line = read("audit");
  const size_t start = line.find(R"("principal":"locusd","peer":"","rpc":"end_lease","subject":"arena-1","code":"OK")");
  ASSERT_NE(start, std::string::npos) << line;
  EXPECT_THAT(line.substr(start, line.find('\n', start) - start), HasSubstr("1 batches changed 3 objects in "));
}

}  // namespace
}  // namespace locus::test
