// The HTTP port of the real daemon: metrics of calls, and health while it starts, serves and drains.
#include "tests/support/daemon_process.h"
#include "tests/support/http_get.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class HttpPortTest : public ::testing::Test {
 protected:
  std::vector<std::string> options(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--http-listen",
                               "127.0.0.1:0", "--http-port-file", folder_.file("http"), "--threads", "2"});
    return more;
  }
  std::string log() const { return folder_.file("log"); }
  std::string address() const {
    return "127.0.0.1:" + std::to_string(DaemonProcess::wait_for_port(folder_.file("port")));
  }
  // Returns the HTTP port. The daemon writes this port to its file before the gRPC port, so address(), which waits for
  // the gRPC port, has waited long enough.
  int http_port() const { return std::atoi(text_of(folder_.file("http")).c_str()); }

  TemporaryFolder folder_;
};

TEST_F(HttpPortTest, MetricsCountCallsAndDescribeScenes) {
  DaemonProcess daemon(options(), log());
  Stubs stubs(address());
  create_scene(stubs, "world");
  {
    grpc::ClientContext context;
    set_timeout(context);
    v1::ApplyUpdatesRequest request;
    request.set_scene("world");
    *request.mutable_batch() = insert_balls(1, 10);
    v1::ApplyUpdatesResponse response;
    ASSERT_TRUE(stubs.updates->ApplyUpdates(&context, request, &response).ok());
  }
  grpc::ClientContext stream_context;
  set_timeout(stream_context);
  const auto stream = stubs.queries->StreamQueries(&stream_context);
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  *request.mutable_batch() = ray_along_x();
  v1::StreamQueriesResponse response;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stream->Write(request));
    ASSERT_TRUE(stream->Read(&response));
  }
  {
    grpc::ClientContext context;
    set_timeout(context);
    v1::QueryRequest missing;
    missing.set_scene("nowhere");
    v1::QueryResponse answer;
    ASSERT_EQ(stubs.queries->Query(&context, missing, &answer).error_code(), grpc::StatusCode::NOT_FOUND);
  }
  const HttpAnswer page = http_get(http_port(), "/metrics");
  EXPECT_EQ(page.code, 200);
  EXPECT_THAT(page.headers, HasSubstr("Content-Type: text/plain; version=0.0.4"));
  for (const char* line :
       {"locus_ready 1\n", "locus_calls_total{rpc=\"CreateScene\",code=\"OK\"} 1\n",
        "locus_calls_total{rpc=\"StreamQueries\",code=\"OK\"} 3\n", "locus_calls_total{rpc=\"Query\",code=\"OK\"} 0\n",
        "locus_calls_total{rpc=\"Query\",code=\"NOT_FOUND\"} 1\n",
        "locus_refusals_total{reason=\"NOT_FOUND\",limit=\"\"} 1\n", "locus_queries_total{kind=\"ray\"} 3\n",
        "locus_update_items_total 10\n", "locus_streams_open{rpc=\"StreamQueries\"} 1\n",
        "locus_scene_objects{scene=\"world\"} 10\n", "locus_scene_revision{scene=\"world\"} 1\n",
        "locus_connections_open 1\n", "locus_limit_used{limit=\"scenes\"} 1\n"})
    EXPECT_THAT(page.body, HasSubstr(line));
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(HttpPortTest, AThousandScenesMakeABoundedNumberOfSeries) {
  DaemonProcess daemon(options(), log());
  Stubs stubs(address());
  for (int i = 0; i < 1000; ++i) create_scene(stubs, "scene-" + std::to_string(i));
  const std::string text = http_get(http_port(), "/metrics").body;
  size_t series = 0;
  for (size_t at = text.find("locus_scene_objects{"); at != std::string::npos;
       at = text.find("locus_scene_objects{", at + 1))
    ++series;
  EXPECT_EQ(series, 101u);
  EXPECT_THAT(text, HasSubstr("locus_scene_objects{scene=\"_other\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("locus_limit_used{limit=\"scenes\"} 1000\n"));
}

TEST_F(HttpPortTest, WhileDrainingTheServerIsAliveAndNotReady) {
  DaemonProcess daemon(options(), log());
  Stubs stubs(address());
  create_scene(stubs, "world");
  EXPECT_EQ(http_get(http_port(), "/healthz").code, 200);
  EXPECT_EQ(http_get(http_port(), "/readyz").body, "ready\n");
  // This upload keeps the server from ending until the caller has sent the whole mesh.
  grpc::ClientContext context;
  set_timeout(context);
  v1::UploadMeshResponse uploaded;
  const auto upload = stubs.scenes->UploadMesh(&context, &uploaded);
  ASSERT_TRUE(upload->Write(whole_mesh("cube")));
  while (http_get(http_port(), "/metrics").body.find("locus_limit_used{limit=\"calls\"} 1\n") == std::string::npos)
    std::this_thread::yield();
  daemon.signal(SIGTERM);
  HttpAnswer ready = http_get(http_port(), "/readyz");
  while (ready.code == 200) ready = http_get(http_port(), "/readyz");
  EXPECT_EQ(ready.code, 503);
  EXPECT_EQ(ready.body, "draining\n");
  EXPECT_EQ(http_get(http_port(), "/healthz").code, 200);
  EXPECT_THAT(http_get(http_port(), "/metrics").body, HasSubstr("locus_ready 0\n"));
  upload->WritesDone();
  EXPECT_TRUE(upload->Finish().ok());
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_EQ(http_get(http_port(), "/healthz").code, 0);
}

TEST_F(HttpPortTest, AnAddressInUseEndsTheDaemonAndIsLogged) {
  DaemonProcess first(options(), log());
  address();
  const std::string taken = "127.0.0.1:" + std::to_string(http_port());
  DaemonProcess second({"--listen", "127.0.0.1:0", "--http-listen", taken}, folder_.file("second"));
  EXPECT_EQ(second.wait(), 1);
  EXPECT_THAT(text_of(folder_.file("second")), HasSubstr("cannot listen on " + taken));
}

TEST_F(HttpPortTest, WithAnEmptyAddressThereIsNoHttpPort) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--http-listen", ""}, log());
  Stubs stubs(address());
  create_scene(stubs, "world");
  EXPECT_THAT(text_of(log()), HasSubstr("http_port=0"));
  EXPECT_THAT(text_of(log()), Not(HasSubstr("cannot listen")));
}

}  // namespace
}  // namespace locus::test
