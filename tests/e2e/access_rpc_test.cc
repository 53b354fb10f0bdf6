// Credentials, changes of rights, the audit log and quotas of a server with access control. rights_table_test.cc has
// the table of all rpcs.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <future>
#include <map>
#include <set>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/observability/process_figures.h"
#include "server/security/token_file.h"
#include "tests/support/access_fixture.h"
#include "tests/support/memory_log.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(AccessRpcTest, WrongCredentialsAreRefusedWithoutAHint) {
  tokens_["wrong"] = tokens_["reader"].substr(0, tokens_["reader"].size() - 1) + "!";
  tokens_["stranger"] = "locus_nobody_0123456789012345678901234567890123456789012";
  const grpc::Status wrong = call("/locus.v1.SceneService/GetScene", "wrong").status;
  const grpc::Status stranger = call("/locus.v1.SceneService/GetScene", "stranger").status;
  EXPECT_EQ(wrong.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(stranger.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(wrong.error_message(), stranger.error_message());
}

TEST_F(AccessRpcTest, AConnectionEndsWithItsThirtyThirdWrongCredential) {
  tokens_["wrong"] = tokens_["reader"].substr(0, tokens_["reader"].size() - 1) + "!";
  const auto health = grpc::health::v1::Health::NewStub(running_->stubs().channel);
  grpc::ClientContext context;
  set_timeout(context);
  const auto watch = health->Watch(&context, {});  // ends with its connection, which the calls below share
  grpc::health::v1::HealthCheckResponse serving;
  ASSERT_TRUE(watch->Read(&serving));
  std::atomic<bool> ended{false};
  std::thread watcher([&] {
    while (watch->Read(&serving)) {
    }
    ended = true;
  });
  for (int i = 0; i < 32; ++i)
    EXPECT_EQ(call("/locus.v1.SceneService/GetScene", "wrong").status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(call("/locus.v1.SceneService/GetScene", "reader").status.ok());
  EXPECT_FALSE(ended);
  call("/locus.v1.SceneService/GetScene", "wrong");
  watcher.join();  // returns when the connection ends
  EXPECT_EQ(watch->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(AccessRpcTest, ListedScenesAreThoseThatTheCallerMayRead) {
  create("lobby-1");
  const auto names = [&](const std::string& who) {
    v1::ListScenesResponse response;
    EXPECT_TRUE(response.ParseFromString(call("/locus.v1.SceneService/ListScenes", who, "").bytes));
    std::string all;
    for (const v1::Scene& scene : response.scenes()) all += scene.name() + " ";
    return all;
  };
  EXPECT_EQ(names("reader"), "arena-1 ");
  EXPECT_EQ(names("elsewhere"), "lobby-1 ");
  EXPECT_EQ(names("admin"), "arena-1 lobby-1 ");
  EXPECT_EQ(names("ops"), "");
}

TEST_F(AccessRpcTest, TheUseOfLimitsIsShownOnlyToThoseWhoMaySeeAllScenesOrMetrics) {
  create("lobby-1");
  const auto used_scenes = [&](const std::string& who) {
    v1::GetServerResponse server;
    EXPECT_TRUE(server.ParseFromString(call("/locus.v1.ServerService/GetServer", who, "").bytes));
    double scenes = 0;
    double all = 0;
    for (const v1::Limit& limit : server.limits()) {
      if (limit.name() == "scenes") scenes = limit.used();
      all += limit.used() + static_cast<double>(limit.refused());
    }
    EXPECT_EQ(server.use_hidden(), all == 0) << who;
    return scenes;
  };
  EXPECT_EQ(used_scenes("admin"), 2);
  EXPECT_EQ(used_scenes("ops"), 2);
  for (const char* who : {"reader", "updater", "elsewhere"}) EXPECT_EQ(used_scenes(who), 0) << who;
}

TEST_F(AccessRpcTest, ADenialNamesTheRightThatTheCallNeeds) {
  const std::string path = "/locus.v1.SceneService/CreateScene";
  EXPECT_THAT(call(path, "reader").status.error_message(), HasSubstr("lacks the right admin"));
  write("access", "grant token:admin admin *\n");  // the reader has no grant any more
  running_->server().reload();
  EXPECT_THAT(call(path, "reader").status.error_message(), HasSubstr("lacks the right admin"));
  EXPECT_THAT(call("/locus.v1.SceneService/ListScenes", "reader").status.error_message(),
              HasSubstr("lacks the right read"));
}

TEST_F(AccessRpcTest, ARevokedTokenEndsItsStreams) {
  grpc::ClientContext context;
  set_timeout(context);
  context.AddMetadata("authorization", "Bearer " + tokens_["reader"]);
  const auto stream = running_->stubs().queries->StreamQueries(&context);
  v1::StreamQueriesRequest request;
  request.set_scene("arena-1");
  ASSERT_TRUE(stream->Write(request));
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  ASSERT_TRUE(server::revoke_token(folder_.file("tokens"), "reader").ok());
  EXPECT_FALSE(stream->Read(&response));  // returns when the stream ends
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(call("/locus.v1.SceneService/GetScene", "reader").status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(call("/locus.v1.SceneService/GetScene", "updater").status.ok());
}

TEST_F(AccessRpcTest, AStreamThatLosesItsGrantEndsAsIfTheSceneWereAbsent) {
  grpc::ClientContext context;
  set_timeout(context);
  context.AddMetadata("authorization", "Bearer " + tokens_["reader"]);
  const auto stream = running_->stubs().queries->StreamQueries(&context);
  v1::StreamQueriesRequest request;
  request.set_scene("arena-1");
  ASSERT_TRUE(stream->Write(request));
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  write("access", "grant token:reader read lobby-*\n");
  running_->server().reload();
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status ended = stream->Finish();
  const grpc::Status absent = call("/locus.v1.SceneService/GetScene", "reader", "lobby-9").status;
  EXPECT_EQ(ended.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(ended.error_message(), "scene: no scene is called 'arena-1'; create it first");
  EXPECT_EQ(absent.error_message(), "scene: no scene is called 'lobby-9'; create it first");
}

TEST_F(AccessRpcTest, CallsThatWaitEndWhenTheyLoseTheirGrant) {
  v1::QueryRequest query;
  query.set_scene("arena-1");
  query.mutable_batch()->mutable_view()->set_at_least(99);
  v1::DumpSceneRequest dump;
  dump.set_scene("arena-1");
  dump.mutable_view()->set_at_least(99);
  const auto wait = [&](const std::string& path, const std::string& bytes) {
    return std::async(std::launch::async, [&, path, bytes] {
      return raw_call(running_->stubs().channel, path, bytes, kCallTimeout, tokens_["reader"]).status;
    });
  };
  std::future<grpc::Status> unary = wait("/locus.v1.QueryService/Query", query.SerializeAsString());
  std::future<grpc::Status> blocking = wait("/locus.v1.SceneService/DumpScene", dump.SerializeAsString());
  wait_for_calls(2);
  write("access", "grant token:admin admin *\n");
  running_->server().reload();
  EXPECT_EQ(unary.get().error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(blocking.get().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(AccessRpcTest, AChangedAccessFileIsInForceAfterAReloadAndABadOneIsNot) {
  write("access", "grant token:reader update arena-*\n");
  running_->server().reload();
  EXPECT_TRUE(call("/locus.v1.UpdateService/ApplyUpdates", "reader").status.ok());
  write("access", "grant token:reader\n");
  running_->server().reload();
  EXPECT_TRUE(call("/locus.v1.UpdateService/ApplyUpdates", "reader").status.ok());
  EXPECT_EQ(call("/locus.v1.SceneService/GetScene", "admin").status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(AccessRpcTest, ChangesAndRefusalsAreAudited) {
  call("/locus.v1.SceneService/DeleteScene", "reader");
  call("/locus.v1.SceneService/DeleteScene", "admin");
  call("/locus.v1.UpdateService/ApplyUpdates", "");
  running_.reset();  // writes the queued lines
  const std::string changes = read("audit"), refusals = read("audit.refused");
  EXPECT_THAT(changes, HasSubstr(R"("principal":"token:admin")"));
  EXPECT_THAT(changes, HasSubstr(R"("subject":"arena-1")"));
  EXPECT_THAT(refusals, HasSubstr(R"("principal":"token:reader")"));
  EXPECT_THAT(refusals, HasSubstr(R"("code":"PERMISSION_DENIED")"));
  EXPECT_THAT(refusals, HasSubstr(R"("rpc":"/locus.v1.UpdateService/ApplyUpdates")"));
  EXPECT_THAT(refusals, HasSubstr(R"("code":"UNAUTHENTICATED")"));
  for (const auto& [name, token] : tokens_) EXPECT_EQ((changes + refusals).find(token), std::string::npos) << name;
}

TEST_F(AccessRpcTest, RefusedChangesAreAuditedWithTheirScenesAndRefusedQueriesOnlyForQuotas) {
  write("access", std::string(kAccess) + "quota token:updater update_items_per_s=5 burst_s=1\n" +
                      "quota token:reader queries_per_s=1 burst_s=1\n");
  running_->server().reload();
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  *update.mutable_batch() = insert_balls(100, 199);
  v1::QueryRequest query;
  query.set_scene("arena-1");
  v1::Rays* rays = query.mutable_batch()->add_blocks()->mutable_rays();
  for (int axis = 0; axis < 6; ++axis) rays->add_origins(0.0f);
  for (int axis = 0; axis < 6; ++axis) rays->add_directions(1.0f);
  const auto send = [&](const std::string& path, const google::protobuf::Message& request, const std::string& who) {
    return raw_call(running_->stubs().channel, path, request.SerializeAsString(), kCallTimeout, tokens_[who]).status;
  };
  EXPECT_EQ(send("/locus.v1.UpdateService/ApplyUpdates", update, "updater").error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(send("/locus.v1.QueryService/Query", query, "reader").error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  update.mutable_batch()->mutable_inserts(0)->clear_positions();
  rays->clear_directions();
  EXPECT_EQ(send("/locus.v1.UpdateService/ApplyUpdates", update, "admin").error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(send("/locus.v1.QueryService/Query", query, "admin").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  running_.reset();  // writes the queued lines
  const std::string audit = read("audit.refused");
  const std::string updates = R"("rpc":"/locus.v1.UpdateService/ApplyUpdates","subject":"arena-1","code":)";
  EXPECT_THAT(audit, HasSubstr(updates + R"("RESOURCE_EXHAUSTED")"));
  EXPECT_THAT(audit, HasSubstr(updates + R"("INVALID_ARGUMENT")"));
  const std::string queries = R"("rpc":"/locus.v1.QueryService/Query","subject":"arena-1","code":)";
  EXPECT_THAT(audit, HasSubstr(queries + R"("RESOURCE_EXHAUSTED")"));
  EXPECT_THAT(audit, Not(HasSubstr(queries + R"("INVALID_ARGUMENT")")));
}

TEST_F(AccessRpcTest, AStepOnAStreamOfQueriesNeedsTheRightToUpdate) {
  v1::StreamQueriesRequest step;
  step.set_scene("arena-1");
  *step.mutable_update() = insert_balls(1, 3);
  const auto answer_to = [&](const v1::StreamQueriesRequest& request, const std::string& who) {
    v1::StreamQueriesResponse answer;
    EXPECT_TRUE(answer.ParseFromString(raw_call(running_->stubs().channel, "/locus.v1.QueryService/StreamQueries",
                                                request.SerializeAsString(), kCallTimeout, tokens_[who])
                                           .bytes));
    return answer;
  };
  EXPECT_EQ(answer_to(step, "reader").error().code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(answer_to(step, "reader").error().message(), HasSubstr("lacks the right update to scene 'arena-1'"));
  EXPECT_EQ(answer_to(step, "elsewhere").error().code(), grpc::StatusCode::NOT_FOUND);
  v1::StreamQueriesRequest without = step;
  without.clear_update();
  EXPECT_EQ(answer_to(without, "reader").result().revision(), 0u);
  EXPECT_EQ(answer_to(step, "updater").ack().applied(), 3u);
  step.mutable_update()->mutable_inserts(0)->clear_positions();
  EXPECT_EQ(answer_to(step, "updater").error().code(), grpc::StatusCode::INVALID_ARGUMENT);
  running_.reset();  // writes the queued lines
  const std::string line = R"("rpc":"/locus.v1.QueryService/StreamQueries","subject":"arena-1","code":)";
  EXPECT_THAT(read("audit.refused"), HasSubstr(line + R"("PERMISSION_DENIED")"));
  EXPECT_THAT(read("audit.refused"), HasSubstr(line + R"("INVALID_ARGUMENT")"));
  EXPECT_THAT(read("audit"), HasSubstr(line + R"("OK")"));
  EXPECT_THAT(read("audit"), HasSubstr("1 batches changed 3 objects in "));
}

TEST_F(AccessRpcTest, QueriesOfAStepThatFailAfterItsUpdateAreNotAuditedAsARefusedChange) {
  v1::StepRequest step;
  step.set_scene("arena-1");
  *step.mutable_update() = insert_balls(1, 3);
  v1::QueryBlock* block = step.mutable_queries()->add_blocks();
  block->mutable_lookup()->add_ids(1);
  block->add_as_of_ticks(3);  // the scene has no history
  v1::StepResponse response;
  ASSERT_TRUE(response.ParseFromString(raw_call(running_->stubs().channel, "/locus.v1.QueryService/Step",
                                                step.SerializeAsString(), kCallTimeout, tokens_["updater"])
                                           .bytes));
  EXPECT_EQ(response.error().code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(response.ack().applied(), 3u);
  running_.reset();  // writes the queued lines
  EXPECT_THAT(read("audit.refused"), Not(HasSubstr("OUT_OF_RANGE")));
}

TEST_F(AccessRpcTest, CallersWithoutCredentialsFillNoAuditFile) {
  call("/locus.v1.SceneService/DeleteScene", "admin");
  for (int i = 0; i < 200; ++i) call("/locus.v1.SceneService/DeleteScene", "");
  running_.reset();  // writes the queued lines
  const std::string changes = read("audit"), refusals = read("audit.refused");
  EXPECT_EQ(changes.find("UNAUTHENTICATED"), std::string::npos);
  EXPECT_LT(std::count(refusals.begin(), refusals.end(), '\n'), 100);
  EXPECT_THAT(refusals, HasSubstr("more refusals were not written"));
}

TEST_F(AccessRpcTest, GuessesAtHiddenScenesAreAuditedOnce) {
  call("/locus.v1.SceneService/GetScene", "elsewhere", "arena-1");
  call("/locus.v1.QueryService/Query", "elsewhere", "arena-2");
  call("/locus.v1.SceneService/DeleteScene", "elsewhere", "arena-3");
  call("/locus.v1.SceneService/GetScene", "reader", "arena-4");  // does not exist, but is not hidden from `reader`
  running_.reset();
  const std::string audit = read("audit.refused");
  EXPECT_THAT(audit, HasSubstr(R"("rpc":"/locus.v1.SceneService/GetScene","subject":"arena-1","code":"NOT_FOUND")"));
  EXPECT_THAT(audit, HasSubstr(R"("rpc":"/locus.v1.QueryService/Query","subject":"arena-2","code":"NOT_FOUND")"));
  EXPECT_THAT(audit, HasSubstr(R"("rpc":"/locus.v1.SceneService/DeleteScene","subject":"arena-3","code":"NOT_FOUND")"));
  EXPECT_THAT(audit, Not(HasSubstr("arena-4")));
  size_t hidden = 0;
  for (size_t at = audit.find("NOT_FOUND"); at != std::string::npos; at = audit.find("NOT_FOUND", at + 1)) ++hidden;
  EXPECT_EQ(hidden, 3u);
}

TEST_F(AccessRpcTest, AcceptedUpdatesAreCountedByPrincipalAndScene) {
  for (uint64_t i = 1; i <= 3; ++i) {
    v1::ApplyUpdatesRequest request;
    request.set_scene("arena-1");
    *request.mutable_batch() = insert_balls(i * 100, i * 100 + 9);
    EXPECT_TRUE(raw_call(running_->stubs().channel, "/locus.v1.UpdateService/ApplyUpdates", request.SerializeAsString(),
                         kCallTimeout, tokens_["updater"])
                    .status.ok());
  }
  running_.reset();
  EXPECT_THAT(read("audit"),
              HasSubstr(R"("rpc":"/locus.v1.UpdateService/ApplyUpdates","subject":"arena-1","code":"OK")"));
  EXPECT_THAT(read("audit"), HasSubstr("3 batches changed 30 objects in "));
}

TEST_F(AccessRpcTest, AQuotaOfQueriesRefusesWithItsName) {
  write("access", "grant token:reader read arena-*\nquota token:reader queries_per_s=10 burst_s=1\n");
  running_->server().reload();
  v1::QueryRequest request;
  request.set_scene("arena-1");
  v1::Rays* rays = request.mutable_batch()->add_blocks()->mutable_rays();
  for (int i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      rays->add_origins(0.0f);
      rays->add_directions(1.0f);
    }
  const auto ask = [&] {
    return raw_call(running_->stubs().channel, "/locus.v1.QueryService/Query", request.SerializeAsString(),
                    kCallTimeout, tokens_["reader"])
        .status;
  };
  EXPECT_TRUE(ask().ok());
  const grpc::Status refused = ask();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("queries_per_s"));
}

TEST_F(AccessRpcTest, AnInflatedMessageCountsForTheQuotaOfItsCaller) {
  running_.reset();
  server::ServerConfig accepting = config();
  accepting.accept_compression = true;
  running_.emplace(accepting);
  create("arena-1");
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  update.mutable_batch()->mutable_remove_ids()->Resize(100'000, 1);
  const auto apply = [&](grpc_compression_algorithm algorithm) {
    grpc::ClientContext context;
    set_timeout(context);
    context.AddMetadata("authorization", "Bearer " + tokens_["updater"]);
    context.set_compression_algorithm(algorithm);
    v1::ApplyUpdatesResponse response;
    return running_->stubs().updates->ApplyUpdates(&context, update, &response);
  };
  // Finds a quota that is just large enough for the message if it is not compressed.
  double quota = 100'000;
  grpc::Status plain = grpc::Status::CANCELLED;
  for (; !plain.ok() && quota < 1e9; quota *= 1.1) {
    write("access", std::string(kAccess) + "quota token:updater bytes_in_flight=" + std::to_string(std::lround(quota)));
    running_->server().reload();
    plain = apply(GRPC_COMPRESS_NONE);
  }
  ASSERT_TRUE(plain.ok()) << plain.error_message();
  const grpc::Status refused = apply(GRPC_COMPRESS_GZIP);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("bytes_in_flight"));
}

// Updates of one identity, on four connections, wait for the log and keep their claims of memory meanwhile. When they
// have claimed the share of one identity, further updates of this identity must be refused.
TEST_F(AccessRpcTest, MoreConnectionsGiveAnIdentityNoMoreMemory) {
  MemoryLog log;
  running_.reset();
  server::ServerConfig scarce = config();
  // The share of one identity must be less than the memory that is left, even in a process that is large already.
  const uint64_t used = server::resident_bytes();
  scarce.memory_limit = used + std::max(used, uint64_t{128} << 20);
  running_.emplace(scarce, &log);
  create("arena-1");
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  v1::Move* const moves = update.mutable_batch()->add_moves();
  moves->mutable_ids()->Resize(30'000, 1);
  moves->mutable_positions()->Resize(3, 0.0f);
  const auto apply = [&update](const Stubs& stubs, const std::string& token) {
    return raw_call(stubs.channel, "/locus.v1.UpdateService/ApplyUpdates", update.SerializeAsString(), kCallTimeout,
                    token)
        .status;
  };
  log.hold();
  // Each of the four connections makes a fourth of the calls, so that no connection reaches the limit of memory for a
  // single connection.
  std::vector<Stubs> connections;
  for (int i = 0; i < 4; ++i) connections.emplace_back(running_->address());
  std::vector<std::future<grpc::Status>> calls;
  std::atomic<bool> refused{false};
  for (size_t i = 0; i < 64 && !refused; ++i) {
    calls.push_back(std::async(std::launch::async, [&, i] {
      grpc::Status status = apply(connections[i % 4], tokens_["updater"]);
      if (!status.ok()) refused = true;
      return status;
    }));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::future<grpc::Status> other =
      std::async(std::launch::async, [&] { return apply(running_->stubs(), tokens_["admin"]); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  log.release();
  const grpc::Status others = other.get();
  EXPECT_TRUE(others.ok()) << "another identity has a share of its own; " << others.error_message();
  std::set<std::string> limits;
  for (std::future<grpc::Status>& call : calls)
    if (const grpc::Status status = call.get(); !status.ok()) limits.insert(error_of(status).limit());
  EXPECT_THAT(limits, ::testing::ElementsAre("identity_memory_bytes"));
}

TEST_F(AccessRpcTest, DescriptionsAndDumpsUseTheQuotaOfWork) {
  v1::ApplyUpdatesRequest updates;
  updates.set_scene("arena-1");
  v1::Insert* insert = updates.mutable_batch()->add_inserts();
  insert->mutable_point();
  for (uint64_t id = 1; id <= 100; ++id) {
    insert->add_ids(id);
    for (int axis = 0; axis < 3; ++axis) insert->add_positions(0.0f);
  }
  ASSERT_TRUE(raw_call(running_->stubs().channel, "/locus.v1.UpdateService/ApplyUpdates", updates.SerializeAsString(),
                       kCallTimeout, tokens_["admin"])
                  .status.ok());
  write("access", std::string(kAccess) + "quota token:reader work_per_s=1\nquota token:updater work_per_s=1\n");
  running_->server().reload();
  const std::map<std::string, std::string> calls = {{"reader", "/locus.v1.SceneService/GetScene"},
                                                    {"updater", "/locus.v1.SceneService/DumpScene"}};
  for (const auto& [who, path] : calls) {
    EXPECT_TRUE(call(path, who).status.ok()) << path;
    const grpc::Status refused = call(path, who).status;
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << path;
    EXPECT_THAT(refused.error_message(), HasSubstr("work_per_s")) << path;
  }
}

// One stream of queries, and its answer to one message.
struct OpenQueries {
  OpenQueries(Stubs& stubs, const std::string& token) {
    set_timeout(context);
    context.AddMetadata("authorization", "Bearer " + token);
    stream = stubs.queries->StreamQueries(&context);
    v1::StreamQueriesRequest request;
    request.set_scene("arena-1");
    stream->Write(request);
    v1::StreamQueriesResponse response;
    is_open = stream->Read(&response);
  }
  grpc::Status end() {
    stream->WritesDone();
    return stream->Finish();
  }
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> stream;
  bool is_open = false;
};

TEST_F(AccessRpcTest, AQuotaThatComesAndGoesCountsTheStreamsThatWereOpenedUnderIt) {
  const std::string without = "grant token:reader read arena-*\n";
  const std::string with = without + "quota token:reader open_streams=1\n";
  const auto reload = [&](const std::string& access) {
    write("access", access);
    running_->server().reload();
  };
  reload(with);
  OpenQueries counted(running_->stubs(), tokens_["reader"]);
  ASSERT_TRUE(counted.is_open);
  reload(without);
  EXPECT_TRUE(counted.end().ok());
  OpenQueries uncounted(running_->stubs(), tokens_["reader"]);
  ASSERT_TRUE(uncounted.is_open);
  reload(with);
  std::optional<OpenQueries> second;  // admitted when the server no longer counts `counted`
  for (int tries = 0; tries < 1000 && !(second && second->is_open); ++tries) {
    if (second) second->end();
    second.emplace(running_->stubs(), tokens_["reader"]);
  }
  ASSERT_TRUE(second->is_open);
  EXPECT_TRUE(uncounted.end().ok());
  for (int tries = 0; tries < 100; ++tries) {
    OpenQueries third(running_->stubs(), tokens_["reader"]);
    EXPECT_FALSE(third.is_open);
    EXPECT_EQ(third.end().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_TRUE(second->end().ok());
}

TEST_F(AccessRpcTest, WorkOfQueriesThatFailIsChargedToTheQuota) {
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  v1::Insert* insert = update.mutable_batch()->add_inserts();
  for (uint64_t id = 1; id <= 2000; ++id) {
    insert->add_ids(id);
    for (int axis = 0; axis < 3; ++axis) insert->add_positions(0.0f);
  }
  insert->mutable_ball()->add_radii(1);
  ASSERT_TRUE(raw_call(running_->stubs().channel, "/locus.v1.UpdateService/ApplyUpdates", update.SerializeAsString(),
                       kCallTimeout, tokens_["admin"])
                  .status.ok());
  write("access", "grant token:reader read arena-*\nquota token:reader work_per_s=1000 burst_s=1\n");
  running_->server().reload();
  v1::QueryRequest request;
  request.set_scene("arena-1");
  v1::Rays* rays = request.mutable_batch()->add_blocks()->mutable_rays();
  rays->set_mode(v1::RAY_MODE_ALL);
  for (int i = 0; i < 3 * 60'000; ++i) {
    rays->add_origins(-2.0f);
    rays->add_directions(1.0f);
  }
  grpc::Status status;
  for (int tries = 0; tries < 200 && status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED; ++tries)
    status = raw_call(running_->stubs().channel, "/locus.v1.QueryService/Query", request.SerializeAsString(),
                      std::chrono::milliseconds(50), tokens_["reader"])
                 .status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("work_per_s"));
}

}  // namespace
}  // namespace locus::test
