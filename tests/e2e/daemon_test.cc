#include <future>

#include "tests/support/daemon_process.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

class DaemonTest : public ::testing::Test {
 protected:
  std::vector<std::string> on_free_port() const {
    return {"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--threads", "2"};
  }
  std::string log() const { return folder_.file("log"); }
  std::string address() const {
    return "127.0.0.1:" + std::to_string(DaemonProcess::wait_for_port(folder_.file("port")));
  }

  static void create_world(Stubs& stubs) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::CreateSceneRequest request;
    request.set_name("world");
    v1::CreateSceneResponse response;
    ASSERT_TRUE(stubs.scenes->CreateScene(&context, request, &response).ok());
  }

  TemporaryFolder folder_;
};

TEST_F(DaemonTest, ItServesOnAFreePortAndExitsWithZeroOnSigterm) {
  DaemonProcess daemon(on_free_port(), log());
  Stubs stubs(address());
  create_world(stubs);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(text_of(log()), HasSubstr("memory only"));
  EXPECT_THAT(text_of(log()), HasSubstr("draining"));
}

TEST_F(DaemonTest, ItNamesTheInstructionSetInUseAndRefusesOneThatTheProcessorLacks) {
  std::vector<std::string> options = on_free_port();
  options.insert(options.end(), {"--instruction-set", "portable"});
  DaemonProcess daemon(options, log());
  Stubs stubs(address());
  create_world(stubs);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(text_of(log()), HasSubstr("instruction_set=portable"));

  DaemonProcess refused({"--listen", "127.0.0.1:0", "--instruction-set", "mmx"}, folder_.file("refused"));
  EXPECT_EQ(refused.wait(), 1);
  EXPECT_THAT(text_of(folder_.file("refused")), HasSubstr("'mmx'; it runs: "));
}

TEST_F(DaemonTest, DrainingEndsStreamsRetryablyAndRunningCallsAreAnswered) {
  DaemonProcess daemon(on_free_port(), log());
  Stubs stubs(address());
  create_world(stubs);
  grpc::ClientContext stream_context;
  set_timeout(stream_context);
  const auto stream = stubs.updates->StreamUpdates(&stream_context);
  v1::StreamUpdatesRequest request;
  request.set_scene("world");
  v1::StreamUpdatesResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  // This upload stays in progress until its caller has sent the whole mesh.
  grpc::ClientContext upload_context;
  set_timeout(upload_context);
  v1::UploadMeshResponse uploaded;
  const auto upload = stubs.scenes->UploadMesh(&upload_context, &uploaded);
  ASSERT_TRUE(upload->Write(whole_mesh("cube")));
  // Wait until two calls are in progress, the upload and GetServer itself, so that the server has begun the upload
  // before the signal is sent.
  grpc::ClientContext info_context;
  set_timeout(info_context);
  v1::GetServerResponse info;
  const auto calls_in_work = [&] {
    grpc::ClientContext context;
    set_timeout(context);
    EXPECT_TRUE(stubs.server->GetServer(&context, {}, &info).ok());
    for (const v1::Limit& limit : info.limits())
      if (limit.name() == "calls") return limit.used();
    return 0.0;
  };
  while (calls_in_work() < 2) std::this_thread::yield();
  daemon.signal(SIGTERM);
  EXPECT_FALSE(stream->Read(&response));
  expect_refused(stream->Finish(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
  // A draining server still answers Health and GetServer, and refuses new work.
  EXPECT_EQ(raw_call(stubs.channel, "/grpc.health.v1.Health/Check", "").bytes, "\x08\x02");
  Stubs probe(address());  // a connection of its own
  EXPECT_EQ(raw_call(probe.channel, "/grpc.health.v1.Health/Check", "").bytes, "\x08\x02");
  EXPECT_EQ(calls_in_work(), 2);
  grpc::ClientContext new_context;
  set_timeout(new_context);
  v1::QueryRequest query;
  query.set_scene("world");
  v1::QueryResponse answer;
  expect_refused(stubs.queries->Query(&new_context, query, &answer),
                 {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
  upload->WritesDone();
  const grpc::Status status = upload->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(uploaded.mesh().triangles(), 12u);
  EXPECT_EQ(daemon.wait(), 0);
}

TEST_F(DaemonTest, AQueryThatWaitsForARevisionDoesNotDelayTheEnd) {
  DaemonProcess daemon(on_free_port(), log());
  Stubs stubs(address());
  create_world(stubs);
  grpc::ClientContext stream_context;
  set_timeout(stream_context);
  const auto stream = stubs.queries->StreamQueries(&stream_context);
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  request.mutable_batch()->mutable_view()->set_at_least(99);
  request.set_sequence(7);
  ASSERT_TRUE(stream->Write(request));
  std::future<grpc::Status> unary = std::async(std::launch::async, [&stubs] {
    grpc::ClientContext context;
    set_timeout(context);
    v1::QueryRequest query;
    query.set_scene("world");
    query.mutable_batch()->mutable_view()->set_at_least(99);
    v1::QueryResponse answer;
    return stubs.queries->Query(&context, query, &answer);
  });
  const auto calls_in_work = [&stubs] {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse info;
    EXPECT_TRUE(stubs.server->GetServer(&context, {}, &info).ok());
    for (const v1::Limit& limit : info.limits())
      if (limit.name() == "calls") return limit.used();
    return 0.0;
  };
  while (calls_in_work() < 2) std::this_thread::yield();
  daemon.signal(SIGTERM);
  expect_refused(unary.get(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
  EXPECT_EQ(daemon.wait(), 0);
  while (stream->Read(&response)) EXPECT_EQ(response.sequence(), 7u);
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(DaemonTest, ASecondSignalEndsItAtOnce) {
  DaemonProcess daemon(on_free_port(), log());
  Stubs stubs(address());
  create_world(stubs);
  grpc::ClientContext context;
  set_timeout(context);
  v1::UploadMeshResponse uploaded;
  const auto upload = stubs.scenes->UploadMesh(&context, &uploaded);
  ASSERT_TRUE(upload->Write(whole_mesh("cube")));
  daemon.signal(SIGINT);
  while (text_of(log()).find("draining") == std::string::npos) std::this_thread::yield();
  daemon.signal(SIGTERM);
  EXPECT_NE(daemon.wait(), 0);
  upload->WritesDone();
  EXPECT_FALSE(upload->Finish().ok());
}

TEST_F(DaemonTest, ItEndsWithItsParentHoweverThatEnds) {
  // The shell is the parent of a daemon that it starts in the background, and is killed while the daemon serves.
  const std::string command =
      absl::StrCat(built_program("locusd"), " --listen 127.0.0.1:0 --http-listen '' --port-file ", folder_.file("port"),
                   " --end-with-parent $$ & wait");
  ChildProcess shell("/bin/sh", {"-c", command}, log());
  Stubs stubs(address());
  create_world(stubs);
  shell.signal(SIGKILL);
  shell.wait();
  for (int i = 0; i < 6000 && text_of(log()).find("ended") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_THAT(text_of(log()), AllOf(HasSubstr("draining"), HasSubstr("ended")));
}

TEST_F(DaemonTest, ItDoesNotStartWithoutTheParentItIsToEndWith) {
  std::vector<std::string> arguments = on_free_port();
  arguments.insert(arguments.end(), {"--end-with-parent", "1"});
  DaemonProcess daemon(arguments, log());
  EXPECT_EQ(daemon.wait(), EXIT_FAILURE);
  EXPECT_THAT(text_of(log()), HasSubstr("process 1 is not the parent of this daemon"));
}

TEST_F(DaemonTest, ItServesOverAUnixSocketAndRemovesIt) {
  std::vector<std::string> arguments = on_free_port();
  const std::string path = folder_.file("locus.sock");
  arguments.insert(arguments.end(), {"--listen", "unix:" + path});
  DaemonProcess daemon(arguments, log());
  address();
  Stubs stubs("unix:" + path);
  create_world(stubs);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(access(path.c_str(), F_OK), 0);
}

TEST_F(DaemonTest, ASecondDaemonOnTheSameAddressFailsWithAReasonAndTheFirstContinues) {
  std::vector<std::string> arguments = on_free_port();
  const std::string path = "unix:" + folder_.file("locus.sock");
  arguments.insert(arguments.end(), {"--listen", path});
  DaemonProcess first(arguments, log());
  const std::string taken = address();
  for (const std::string& listen : {taken, path}) {
    TemporaryFolder other;
    DaemonProcess second({"--listen", listen}, other.file("log"));
    EXPECT_EQ(second.wait(), 1);
    const std::string said = text_of(other.file("log"));
    EXPECT_THAT(said, HasSubstr("cannot listen on " + listen));
    EXPECT_THAT(said, HasSubstr("another"));
  }
  Stubs stubs(taken);
  create_world(stubs);
  Stubs over_unix(path);
  grpc::ClientContext context;
  set_timeout(context);
  v1::GetServerResponse server;
  EXPECT_TRUE(over_unix.server->GetServer(&context, {}, &server).ok());
}

TEST_F(DaemonTest, MistakesOnTheCommandLineEndWithTwo) {
  DaemonProcess unknown({"--no-such-option"}, log());
  EXPECT_EQ(unknown.wait(), 2);
  EXPECT_THAT(text_of(log()), HasSubstr("--help"));
  DaemonProcess open({"--listen", "0.0.0.0:0"}, log());
  EXPECT_EQ(open.wait(), 2);
  EXPECT_THAT(text_of(log()), HasSubstr("--insecure"));
  DaemonProcess help({"--help"}, log());
  EXPECT_EQ(help.wait(), 0);
  EXPECT_THAT(text_of(log()), HasSubstr("Examples:"));
}

TEST_F(DaemonTest, TheLogCanBeJson) {
  std::vector<std::string> arguments = on_free_port();
  arguments.insert(arguments.end(), {"--log-format", "json"});
  DaemonProcess daemon(arguments, log());
  Stubs stubs(address());
  create_world(stubs);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  std::istringstream lines(text_of(log()));
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_EQ(line.front(), '{') << line;
    EXPECT_EQ(line.back(), '}') << line;
    EXPECT_THAT(line, HasSubstr("\"message\":\""));
  }
  EXPECT_GE(count, 4);
  EXPECT_THAT(text_of(log()), HasSubstr("\"message\":\"scene created\",\"scene\":\"world\""));
}

}  // namespace
}  // namespace locus::test
