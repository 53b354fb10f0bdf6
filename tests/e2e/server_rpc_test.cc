#include <set>

#include "core/base/instruction_set.h"
#include "core/base/limits.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ServerRpcTest = RpcTest;

v1::GetServerResponse get_server(Stubs& stubs) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::GetServerResponse response;
  EXPECT_TRUE(stubs.server->GetServer(&context, {}, &response).ok());
  return response;
}

const v1::Limit& limit_of(const v1::GetServerResponse& server, const std::string& name) {
  for (const v1::Limit& limit : server.limits())
    if (limit.name() == name) return limit;
  ADD_FAILURE() << "no limit " << name;
  return v1::Limit::default_instance();
}

TEST_F(ServerRpcTest, TheServerReportsItsVersionAndFeatures) {
  const v1::GetServerResponse server = get_server(stubs());
  EXPECT_EQ(server.version(), LOCUS_VERSION);
  EXPECT_EQ(server.instruction_set(), instruction_set());
  EXPECT_THAT(
      server.features(),
      ::testing::ElementsAre("after_t", "anchors", "as_of", "balls", "boxes", "by_list", "capsules", "cell_size",
                             "cells", "compounds", "contains", "continues", "count_only", "download_mesh",
                             "expire_ticks", "frustums", "history", "idle_ttl", "latest_wins", "leases", "lookup",
                             "mesh_grace", "nearest", "pairs", "rays", "sight", "static_from", "step", "sweeps"));
}

TEST_F(ServerRpcTest, AServerThatWasStartedInsecureSaysSo) {
  EXPECT_FALSE(get_server(stubs()).insecure());
  server::ServerConfig config = test_config();
  config.insecure = true;
  RunningServer insecure(config);
  EXPECT_TRUE(get_server(insecure.stubs()).insecure());
}

TEST_F(ServerRpcTest, TheHttpPortIsSaid) {
  EXPECT_EQ(get_server(stubs()).http_port(), 0u);
  EXPECT_EQ(get_server(stubs()).http_host(), "");
  server::ServerConfig config = test_config();
  config.http_listen = "127.0.0.1:0";
  RunningServer with_http(config);
  const v1::GetServerResponse server = get_server(with_http.stubs());
  EXPECT_EQ(server.http_port(), with_http.server().http_port());
  EXPECT_EQ(server.http_host(), "127.0.0.1");
}

TEST_F(ServerRpcTest, LimitsAreListedInOrderWithTheirUse) {
  const v1::GetServerResponse server = get_server(stubs());
  std::vector<std::string> names;
  for (const v1::Limit& limit : server.limits()) names.push_back(limit.name());
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  EXPECT_EQ(limit_of(server, "scenes").value(), limits::kMaxScenes);
  EXPECT_EQ(limit_of(server, "scenes").used(), 1);
  EXPECT_EQ(limit_of(server, "meshes").used(), 0);
  EXPECT_EQ(limit_of(server, "calls").used(), 1);
  EXPECT_EQ(limit_of(server, "queries").value(), limits::kMaxQueries);
  EXPECT_EQ(limit_of(server, "rays").value(), limits::kMaxRays);
  EXPECT_EQ(limit_of(server, "interpolated_bytes").value(), static_cast<double>(limits::kMaxInterpolatedBytes));
  EXPECT_EQ(limit_of(server, "receive_bytes").value(), limits::kReceiveBytes);
}

TEST_F(ServerRpcTest, LimitsCountWhatTheyHaveRefused) {
  EXPECT_EQ(limit_of(get_server(stubs()), "history_ticks").refused(), 0u);
  grpc::ClientContext context;
  set_timeout(context);
  v1::CreateSceneRequest request;
  request.set_name("other");
  request.mutable_spec()->set_history_ticks(limits::kMaxHistoryTicks + 1);
  v1::CreateSceneResponse response;
  EXPECT_FALSE(stubs().scenes->CreateScene(&context, request, &response).ok());
  EXPECT_EQ(limit_of(get_server(stubs()), "history_ticks").refused(), 1u);
}

TEST_F(ServerRpcTest, OpenStreamsCountAsUsed) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(limit_of(get_server(stubs()), "streams").used(), 1);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(ServerRpcTest, HealthAnswersServingForTheServerAndEachService) {
  for (const std::string service : {"", "locus.v1.QueryService", "locus.v1.SceneService"}) {
    // Both messages are encoded by hand: `service` is field 1 of HealthCheckRequest, `status` is field 1 of
    // HealthCheckResponse, and SERVING is 1.
    const std::string request =
        service.empty() ? "" : std::string("\x0a") + static_cast<char>(service.size()) + service;
    const RawReply reply = raw_call(stubs().channel, "/grpc.health.v1.Health/Check", request);
    EXPECT_TRUE(reply.status.ok()) << service << ": " << reply.status.error_message();
    EXPECT_EQ(reply.bytes, "\x08\x01") << service;
  }
  const RawReply unknown = raw_call(stubs().channel, "/grpc.health.v1.Health/Check", "\x0a\x02no");
  EXPECT_EQ(unknown.status.error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(ServerRpcTest, ReflectionListsEveryService) {
  // Bytes of ServerReflectionRequest{list_services = 7: ""}; the reply contains the names as plain text.
  const RawReply reply = raw_call(stubs().channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                  std::string("\x3a\x00", 2));
  EXPECT_TRUE(reply.status.ok()) << reply.status.error_message();
  for (const char* service : {"locus.v1.ServerService", "locus.v1.SceneService", "locus.v1.UpdateService",
                              "locus.v1.QueryService", "grpc.health.v1.Health"})
    EXPECT_THAT(reply.bytes, ::testing::HasSubstr(service));
}

// Returns the bytes of ServerReflectionRequest{file_containing_symbol = 4: symbol}.
std::string symbol_question(const std::string& symbol) {
  const size_t n = symbol.size();
  return std::string({'\x22', static_cast<char>(0x80 | (n & 0x7F)), static_cast<char>(n >> 7)}) + symbol;
}

TEST_F(ServerRpcTest, LongReflectionQuestionsAreRefusedBeforeTheyAreLookedUp) {
  constexpr const char* kReflect = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
  const RawReply asked = raw_call(stubs().channel, kReflect, symbol_question(std::string(500, '.')));
  EXPECT_TRUE(asked.status.ok()) << asked.status.error_message();
  EXPECT_THAT(asked.bytes, ::testing::HasSubstr("the schema has no ...."));
  std::string unknown = "\xca\x3e";  // field 1001, of 512 bytes, which the schema does not have
  unknown += "\x80\x04" + std::string(512, 'x');
  for (const std::string& question : {symbol_question(std::string(10'000, '.')), unknown}) {
    const RawReply refused = raw_call(stubs().channel, kReflect, question);
    expect_refused(refused.status, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, ""});
    EXPECT_THAT(refused.status.error_message(), ::testing::HasSubstr("reflection_request_bytes"));
  }
}

}  // namespace
}  // namespace locus::test
