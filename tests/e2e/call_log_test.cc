// Log lines of calls: request ids that the caller sent or the daemon generated, traceparents, and slow queries.
#include "tests/support/daemon_process.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTraceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

class CallLogTest : public ::testing::Test {
 protected:
  void start(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--http-listen", "",
                               "--threads", "2", "--log-level", "debug"});
    daemon_.emplace(more, folder_.file("log"));
    stubs_.emplace("127.0.0.1:" + std::to_string(DaemonProcess::wait_for_port(folder_.file("port"))));
  }

  using Metadata = std::vector<std::pair<std::string, std::string>>;

  // Makes a call that succeeds and returns the request id of its trailing metadata.
  std::string create_scene(const std::string& name, const Metadata& metadata = {}) {
    grpc::ClientContext context;
    set_timeout(context);
    for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
    v1::CreateSceneRequest request;
    request.set_name(name);
    v1::CreateSceneResponse response;
    EXPECT_TRUE(stubs_->scenes->CreateScene(&context, request, &response).ok());
    return request_id(context);
  }

  std::string query(const std::string& scene, const Metadata& metadata = {}) {
    grpc::ClientContext context;
    set_timeout(context);
    for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
    v1::QueryRequest request;
    request.set_scene(scene);
    *request.mutable_batch() = ray_along_x();
    v1::QueryResponse response;
    stubs_->queries->Query(&context, request, &response);
    return request_id(context);
  }

  static std::string request_id(const grpc::ClientContext& context) {
    const auto found = context.GetServerTrailingMetadata().find("x-request-id");
    if (found == context.GetServerTrailingMetadata().end()) return "";
    return std::string(found->second.data(), found->second.size());
  }

  // Returns the log. Call it after the daemon has ended.
  std::string log() {
    daemon_->signal(SIGTERM);
    EXPECT_EQ(daemon_->wait(), 0);
    return text_of(folder_.file("log"));
  }

  TemporaryFolder folder_;
  std::optional<DaemonProcess> daemon_;
  std::optional<Stubs> stubs_;
};

TEST_F(CallLogTest, LinesOfACallHaveTheCallersIdsAndTheRequestIdIsReturned) {
  start();
  EXPECT_EQ(create_scene("world", {{"x-request-id", "mine-1"}, {"traceparent", kTraceparent}}), "mine-1");
  EXPECT_EQ(query("nowhere", {{"x-request-id", "mine-2"}}), "mine-2");
  const std::string text = log();
  EXPECT_THAT(text, HasSubstr(std::string("scene created scene=world request_id=mine-1 traceparent=") + kTraceparent));
  EXPECT_THAT(text, HasSubstr("request_id=mine-2"));
}

TEST_F(CallLogTest, ACallWithoutARequestIdGetsOne) {
  start();
  const std::string id = create_scene("world");
  EXPECT_EQ(id.size(), 16u);
  const std::string refused = query("nowhere");
  EXPECT_EQ(refused.size(), 16u);
  EXPECT_NE(refused, id);
  const std::string text = log();
  EXPECT_THAT(text, HasSubstr("scene=world request_id=" + id));
  EXPECT_THAT(text, HasSubstr("rpc=Query"));
  EXPECT_THAT(text, HasSubstr("request_id=" + refused));
}

TEST_F(CallLogTest, InvalidIdsAreIgnored) {
  start();
  const std::string id = create_scene("world", {{"x-request-id", "has space"}, {"traceparent", "00-zz-zz-01"}});
  EXPECT_EQ(id.size(), 16u);
  const std::string text = log();
  EXPECT_THAT(text, HasSubstr("request_id=" + id));
  EXPECT_THAT(text, Not(HasSubstr("has space")));
  EXPECT_THAT(text, Not(HasSubstr("traceparent")));
}

TEST_F(CallLogTest, ASlowBatchIsLoggedWithItsQueriesAndWork) {
  start({"--slow-query-ms", "1"});
  create_scene("world");
  grpc::ClientContext context;
  set_timeout(context);
  context.AddMetadata("x-request-id", "slow-1");
  v1::ApplyUpdatesRequest balls;
  balls.set_scene("world");
  *balls.mutable_batch() = insert_balls(1, 20000);
  v1::ApplyUpdatesResponse applied;
  {
    grpc::ClientContext update;
    set_timeout(update);
    ASSERT_TRUE(stubs_->updates->ApplyUpdates(&update, balls, &applied).ok());
  }
  v1::QueryRequest request;
  request.set_scene("world");
  v1::Balls* everything = request.mutable_batch()->add_blocks()->mutable_balls();
  for (int i = 0; i < 100; ++i) {
    for (int axis = 0; axis < 3; ++axis) everything->add_centers(0);
    everything->add_radii(1e6f);
  }
  v1::QueryResponse response;
  const grpc::Status status = stubs_->queries->Query(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const std::string text = log();
  EXPECT_THAT(text, HasSubstr("slow queries rpc=Query scene=world revision=1 kinds=ball queries=100 ms="));
  EXPECT_THAT(text, HasSubstr("request_id=slow-1"));
}

}  // namespace
}  // namespace locus::test
