// Quotas of a server: each quota is enforced, a refusal says what the caller can do, and released resources no longer
// count towards the quota. After a restart, a scene still counts towards the quota of the caller that created it.
#include <filesystem>
#include <fstream>
#include <map>

#include "absl/strings/str_cat.h"
#include "core/mesh/triangle_mesh.h"
#include "core/scene/statics/static_mesh.h"
#include "server/security/token_file.h"
#include "server/storage/rocksdb_log.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kGrants = "grant token:* read,update,admin *\ngrant token:* meshes\n";

class QuotaRpcTest : public ::testing::Test {
 protected:
  QuotaRpcTest() {
    for (const char* name : {"maker", "other"})
      tokens_[name] = *server::add_token(folder_.file("tokens"), name, 1'000'000, {}, "");
    set_quotas("");
    start();
  }

  void start() {
    server::ServerConfig config = test_config();
    config.access_file = folder_.file("access");
    config.token_file = folder_.file("tokens");
    server::StorageOptions options;
    options.path = folder_.file("data");
    absl::StatusOr<std::unique_ptr<server::RocksdbLog>> log = server::RocksdbLog::open(options);
    ASSERT_TRUE(log.ok()) << log.status();
    log_ = *std::move(log);
    running_.emplace(config, log_.get());
  }
  void restart() {
    running_.reset();
    log_.reset();
    start();
  }

  // Writes the access file. The running server, if there is one, uses the new file when this function returns.
  void set_quotas(const std::string& lines) {
    const std::string fresh = folder_.file("access.new");
    std::ofstream(fresh) << kGrants << lines;
    std::filesystem::permissions(fresh, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    std::filesystem::rename(fresh, folder_.file("access"));
    if (running_) running_->server().reload();
  }

  void as(grpc::ClientContext& context, const std::string& who) {
    set_timeout(context);
    context.AddMetadata("authorization", "Bearer " + tokens_[who]);
  }

  grpc::Status create(const std::string& name, const v1::SceneSpec& spec = {}, const std::string& who = "maker") {
    grpc::ClientContext context;
    as(context, who);
    v1::CreateSceneRequest request;
    request.set_name(name);
    *request.mutable_spec() = spec;
    v1::CreateSceneResponse response;
    return running_->stubs().scenes->CreateScene(&context, request, &response);
  }
  void remove_scene(const std::string& name) {
    grpc::ClientContext context;
    as(context, "maker");
    v1::DeleteSceneRequest request;
    request.set_name(name);
    v1::DeleteSceneResponse response;
    EXPECT_TRUE(running_->stubs().scenes->DeleteScene(&context, request, &response).ok());
  }
  grpc::Status apply(const v1::UpdateBatch& batch, const std::string& who = "maker") {
    grpc::ClientContext context;
    as(context, who);
    v1::ApplyUpdatesRequest request;
    request.set_scene("a");
    *request.mutable_batch() = batch;
    v1::ApplyUpdatesResponse response;
    return running_->stubs().updates->ApplyUpdates(&context, request, &response);
  }
  grpc::Status upload(const std::string& name, const v1::UploadMeshRequest& mesh, const std::string& who = "maker") {
    grpc::ClientContext context;
    as(context, who);
    v1::UploadMeshResponse response;
    const auto writer = running_->stubs().scenes->UploadMesh(&context, &response);
    v1::UploadMeshRequest named = mesh;
    named.set_mesh(name);
    writer->Write(named);
    writer->WritesDone();
    return writer->Finish();
  }
  void remove_mesh(const std::string& name) {
    grpc::ClientContext context;
    as(context, "maker");
    v1::DeleteMeshRequest request;
    request.set_mesh(name);
    v1::DeleteMeshResponse response;
    EXPECT_TRUE(running_->stubs().scenes->DeleteMesh(&context, request, &response).ok());
  }
  grpc::Status ask(const v1::QueryBatch& batch, const std::string& who = "maker") {
    grpc::ClientContext context;
    as(context, who);
    v1::QueryRequest request;
    request.set_scene("a");
    *request.mutable_batch() = batch;
    v1::QueryResponse response;
    return running_->stubs().queries->Query(&context, request, &response);
  }

  grpc::Status step(const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
    grpc::ClientContext context;
    as(context, "maker");
    v1::StepRequest request;
    request.set_scene("a");
    *request.mutable_update() = update;
    *request.mutable_queries() = queries;
    v1::StepResponse response;
    return running_->stubs().queries->Step(&context, request, &response);
  }

  // Expects a refusal of the quota `name` whose text contains `text`.
  static void expect_quota(const grpc::Status& status, const std::string& name, const std::string& text) {
    ASSERT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat("quota ", name, " of ")));
    EXPECT_THAT(status.error_message(), HasSubstr(text));
    EXPECT_EQ(error_of(status).limit(), name);
    EXPECT_EQ(error_of(status).reason(), v1::REASON_LIMIT);
  }

  const TemporaryFolder folder_;
  std::map<std::string, std::string> tokens_;
  std::unique_ptr<server::RocksdbLog> log_;
  std::optional<RunningServer> running_;
};

v1::SceneSpec with_history(uint64_t bytes) {
  v1::SceneSpec spec;
  spec.set_history_ticks(4);
  spec.set_history_bytes(bytes);
  return spec;
}

TEST_F(QuotaRpcTest, ScenesCountForTheirCreatorAlsoAfterARestart) {
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(create("others", {}, "other").ok());
  set_quotas("quota token:* scenes=2\n");  // also counts scenes that exist already
  ASSERT_TRUE(create("b").ok());
  for (int times = 0; times < 2; ++times) {
    expect_quota(create("c"), "scenes", "token:maker is 2, asked for 1; 2 are in use; delete a scene");
    restart();
  }
  v1::CreateSceneRequest known;
  known.set_name("a");
  known.set_if_absent(true);
  grpc::ClientContext context;
  as(context, "maker");
  v1::CreateSceneResponse response;
  EXPECT_TRUE(running_->stubs().scenes->CreateScene(&context, known, &response).ok());
  EXPECT_TRUE(create("c", {}, "other").ok());
  remove_scene("a");
  EXPECT_TRUE(create("d").ok());
}

TEST_F(QuotaRpcTest, TheQueriesOfARefusedStepUseNoQuota) {
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(apply(insert_balls(1, 5)).ok());
  set_quotas("quota token:maker queries_per_s=1\n");
  v1::UpdateBatch refused;
  refused.set_all_or_nothing(true);
  refused.add_remove_ids(99);
  for (int times = 0; times < 50; ++times)
    EXPECT_EQ(error_of(step(refused, ray_along_x())).reason(), v1::REASON_UNKNOWN_ID) << times;
  EXPECT_TRUE(step({}, ray_along_x()).ok());
  grpc::Status status;
  for (int times = 0; times < 50 && status.ok(); ++times) status = step({}, ray_along_x());
  EXPECT_EQ(error_of(status).limit(), "queries_per_s") << "the queries of other steps use the quota";
}

TEST_F(QuotaRpcTest, QueriesRefusedForTheirWorkUseNoQuotaOfQueries) {
  constexpr const char* kQueries = "quota token:maker queries_per_s=1\n";
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(apply(insert_balls(1, 5)).ok());
  ASSERT_TRUE(ask(ray_along_x()).ok());  // while no quota limits it
  set_quotas(absl::StrCat(kQueries, "quota token:maker work_per_s=1\n"));
  grpc::Status status = ask(ray_along_x());
  ASSERT_TRUE(status.ok()) << status.error_message();
  for (int times = 0; times < 50; ++times) EXPECT_EQ(error_of(ask(ray_along_x())).limit(), "work_per_s") << times;
  set_quotas(kQueries);
  status = ask(ray_along_x());
  EXPECT_TRUE(status.ok()) << status.error_message();
}

// The quota is checked for all messages together, when the last one has arrived.
TEST_F(QuotaRpcTest, NothingOfARevisionOfSeveralMessagesShowsIfTogetherTheyExceedTheQuotaOfObjects) {
  set_quotas("quota token:maker objects=10\n");
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(apply(insert_balls(1, 6)).ok());
  grpc::ClientContext context;
  as(context, "maker");
  const auto stream = running_->stubs().updates->StreamUpdates(&context);
  const auto send = [&](const v1::UpdateBatch& batch, bool continues) {
    v1::StreamUpdatesRequest request;
    request.set_scene("a");
    *request.mutable_batch() = batch;
    request.mutable_batch()->set_continues(continues);
    v1::StreamUpdatesResponse response;
    EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
    return response;
  };
  const auto scene = [&] {
    grpc::ClientContext asking;
    as(asking, "maker");
    v1::GetSceneRequest request;
    request.set_name("a");
    v1::GetSceneResponse response;
    EXPECT_TRUE(running_->stubs().scenes->GetScene(&asking, request, &response).ok());
    return response.scene();
  };
  EXPECT_TRUE(send(insert_balls(7, 8), true).ack().pending());
  EXPECT_TRUE(send(insert_balls(9, 10), true).ack().pending());
  const v1::StreamUpdatesResponse refused = send(insert_balls(11, 11), false);
  EXPECT_EQ(refused.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << refused.ShortDebugString();
  EXPECT_EQ(refused.error().limit(), "objects");
  EXPECT_EQ(scene().objects(), 6u);
  EXPECT_EQ(scene().revision(), 1u);
  EXPECT_TRUE(send(insert_balls(7, 8), true).ack().pending());
  EXPECT_EQ(send(insert_balls(9, 10), false).ack().applied(), 4u);
  EXPECT_EQ(scene().objects(), 10u);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(QuotaRpcTest, ObjectsCountForTheCreatorOfTheirSceneWhoeverInsertsThem) {
  set_quotas("quota token:maker objects=10\n");
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(create("b").ok());
  ASSERT_TRUE(apply(insert_balls(1, 6)).ok());
  ASSERT_TRUE(apply(insert_balls(7, 10), "other").ok());
  for (int times = 0; times < 2; ++times) {
    const std::string text = "token:maker is 10, asked for 1; 10 are in use; remove objects";
    expect_quota(apply(insert_balls(11, 11)), "objects", text);
    expect_quota(apply(insert_balls(11, 11), "other"), "objects", text);
    restart();
  }
  v1::UpdateBatch again = insert_balls(1, 10);
  again.set_upsert(true);
  EXPECT_TRUE(apply(again).ok()) << "replaces objects";
  v1::UpdateBatch swap = insert_balls(11, 12);
  swap.add_remove_ids(1);
  swap.add_remove_ids(2);
  EXPECT_TRUE(apply(swap).ok());
  v1::UpdateBatch anew = insert_balls(1, 10);
  anew.set_clear(true);
  EXPECT_TRUE(apply(anew).ok());
  v1::UpdateBatch too_many = insert_balls(1, 11);
  too_many.set_clear(true);
  expect_quota(apply(too_many), "objects", "asked for 1;");
  remove_scene("a");
  ASSERT_TRUE(create("a", {}, "other").ok());
  EXPECT_TRUE(apply(insert_balls(1, 50)).ok()) << "the scene of another creator";
}

TEST_F(QuotaRpcTest, MeshBytesCountForEachNameThatTheCallerUploaded) {
  const CubeMesh cube;
  const uint64_t bytes =
      (*StaticMesh::build("cube", {}, *TriangleMesh::create(cube.vertices, cube.indices, {})))->bytes();
  set_quotas(absl::StrCat("quota token:* mesh_bytes=", 2 * bytes + bytes / 2, "\n"));
  ASSERT_TRUE(upload("one", whole_mesh("", cube)).ok());
  ASSERT_TRUE(upload("two", whole_mesh("", cube)).ok());
  ASSERT_TRUE(upload("two", whole_mesh("", cube)).ok()) << "already known";
  for (int times = 0; times < 2; ++times) {
    expect_quota(upload("three", whole_mesh("", cube)), "mesh_bytes", "delete meshes that it uploaded");
    restart();
  }
  ASSERT_TRUE(upload("others", whole_mesh("", cube), "other").ok());
  remove_mesh("one");
  EXPECT_TRUE(upload("three", whole_mesh("", cube)).ok());
  CubeMesh large;
  while (large.indices.size() < 30'000) large.indices.push_back(large.indices[large.indices.size() % 36]);
  expect_quota(upload("large", whole_mesh("", large), "other"), "mesh_bytes", "asked for 360000;");
}

TEST_F(QuotaRpcTest, HistoryBytesAreThoseThatScenesMayTake) {
  set_quotas("quota token:* history_bytes=1000000\n");
  ASSERT_TRUE(create("a", with_history(600'000)).ok());
  for (int times = 0; times < 2; ++times) {
    expect_quota(create("b", with_history(600'000)), "history_bytes", "600000 are in use; ask for fewer history_bytes");
    restart();
  }
  expect_quota(create("b", with_history(0)), "history_bytes", "asked for 268435456");
  EXPECT_TRUE(create("c").ok());
  EXPECT_TRUE(create("d", with_history(400'000)).ok());
  remove_scene("a");
  EXPECT_TRUE(create("b", with_history(600'000)).ok());
}

TEST_F(QuotaRpcTest, BytesInFlightAreGivenBackWithTheAnswer) {
  ASSERT_TRUE(create("a").ok());
  set_quotas("quota token:maker bytes_in_flight=400000\n");
  v1::QueryBatch large = ray_along_x();
  for (int i = 1; i < 20'000; ++i) {
    large.mutable_blocks(0)->mutable_rays()->mutable_origins()->Add(0);
    large.mutable_blocks(0)->mutable_rays()->mutable_origins()->Add(0);
    large.mutable_blocks(0)->mutable_rays()->mutable_origins()->Add(0);
  }
  for (int times = 0; times < 100; ++times) ASSERT_TRUE(ask(ray_along_x()).ok()) << times;
  const grpc::Status status = ask(large);
  expect_quota(status, "bytes_in_flight", "send smaller messages, or ask for less");
  EXPECT_EQ(error_of(status).retry_after_ms(), 0u);
  EXPECT_TRUE(ask(large, "other").ok());
  EXPECT_TRUE(ask(ray_along_x()).ok());
  set_quotas("quota connection:* bytes_in_flight=400000\n");
  expect_quota(ask(large, "other"), "bytes_in_flight", "of connection:");
}

TEST_F(QuotaRpcTest, CallersSeeTheirQuotasAndAdministratorsThoseOfAll) {
  set_quotas("quota token:* scenes=8 queries_per_s=1000 open_streams=4\nquota connection:* open_streams=2\n");
  ASSERT_TRUE(create("a", with_history(5000)).ok());
  ASSERT_TRUE(apply(insert_balls(1, 3)).ok());
  const auto ask_quotas = [&](const std::string& who, const v1::GetQuotasRequest& request,
                              v1::GetQuotasResponse& response) {
    grpc::ClientContext context;
    as(context, who);
    return running_->stubs().server->GetQuotas(&context, request, &response);
  };
  const auto quota_in = [](const v1::IdentityQuotas& entry, const std::string& name) {
    for (const v1::QuotaUse& quota : entry.quotas())
      if (quota.name() == name) return quota;
    ADD_FAILURE() << name << " is not in " << entry.identity();
    return v1::QuotaUse();
  };
  v1::GetQuotasResponse own;
  ASSERT_TRUE(ask_quotas("maker", {}, own).ok());
  ASSERT_EQ(own.identities_size(), 2);
  EXPECT_EQ(own.identities(0).identity(), "token:maker");
  EXPECT_EQ(own.identities(0).quotas_size(), 9);
  EXPECT_EQ(quota_in(own.identities(0), "scenes").limit(), 8);
  EXPECT_EQ(quota_in(own.identities(0), "scenes").used(), 1);
  EXPECT_EQ(quota_in(own.identities(0), "scenes").available(), 7);
  EXPECT_EQ(quota_in(own.identities(0), "objects").used(), 3);
  EXPECT_FALSE(quota_in(own.identities(0), "objects").has_limit());
  EXPECT_EQ(quota_in(own.identities(0), "history_bytes").used(), 5000);
  EXPECT_EQ(quota_in(own.identities(0), "queries_per_s").available(), 2000);
  EXPECT_THAT(own.identities(1).identity(), HasSubstr("connection:"));
  EXPECT_EQ(quota_in(own.identities(1), "open_streams").limit(), 2);
  EXPECT_EQ(own.identities(1).quotas_size(), 5);

  v1::GetQuotasRequest request;
  request.set_all(true);
  request.set_page_size(1);
  std::vector<std::string> names;
  do {
    v1::GetQuotasResponse page;
    ASSERT_TRUE(ask_quotas("other", request, page).ok());
    for (const v1::IdentityQuotas& entry : page.identities()) names.push_back(entry.identity());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names, ::testing::Contains("token:maker"));
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));

  v1::GetQuotasRequest other;
  other.set_identity("token:maker");
  v1::GetQuotasResponse response;
  ASSERT_TRUE(ask_quotas("other", other, response).ok());
  EXPECT_EQ(quota_in(response.identities(0), "objects").used(), 3);
  const std::string fresh = folder_.file("access.new");
  std::ofstream(fresh) << "grant token:* read,update,admin arena-*\n";
  std::filesystem::permissions(fresh, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  std::filesystem::rename(fresh, folder_.file("access"));
  running_->server().reload();
  EXPECT_EQ(ask_quotas("other", other, response).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(ask_quotas("maker", other, response).ok()) << "its own";
  request.clear_page_token();
  EXPECT_EQ(ask_quotas("maker", request, response).error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(QuotaRpcTest, OpenStreamsAreGivenBackWhenTheyEnd) {
  ASSERT_TRUE(create("a").ok());
  set_quotas("quota token:maker open_streams=1\n");
  const auto open = [&](grpc::ClientContext& context) {
    as(context, "maker");
    auto stream = running_->stubs().queries->StreamQueries(&context);
    v1::StreamQueriesRequest request;
    request.set_scene("a");
    stream->Write(request);
    v1::StreamQueriesResponse response;
    return std::pair(stream->Read(&response), std::move(stream));
  };
  for (int times = 0; times < 3; ++times) {
    grpc::ClientContext first_context, second_context;
    auto [first_open, first] = open(first_context);
    ASSERT_TRUE(first_open);
    auto [second_open, second] = open(second_context);
    EXPECT_FALSE(second_open);
    expect_quota(second->Finish(), "open_streams", "1 are in use; end a stream");
    // The first stream still counts after the quotas have changed.
    set_quotas("");
    set_quotas("quota token:maker open_streams=1\n");
    first->WritesDone();
    ASSERT_TRUE(first->Finish().ok());
  }
}

}  // namespace
}  // namespace locus::test
