// Callers that cancel, callers that do not read, and thousands of callers that connect and disconnect: all resources
// must be released, and a well-behaved caller must still be answered. The suites named Long... repeat these tests more
// often.
#include <dirent.h>
#include <sys/resource.h>

#include <algorithm>
#include <thread>

#include "core/base/limits.h"
#include "tests/support/rpc_test.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using QueryStream = grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;

class FaultTest : public RpcTest {
 protected:
  explicit FaultTest(const server::ServerConfig& config = test_config()) : RpcTest(config) {}

  static constexpr uint64_t kObjects = 2'000;
  // Pause between two polls. Polling without a pause would occupy a core that the polled threads need.
  static constexpr std::chrono::milliseconds kPatience{2};
  // Deadline of streams that stay open during a test, long enough for a busy machine.
  static constexpr std::chrono::hours kNoHurry{1};

  void SetUp() override {
    RpcTest::SetUp();
    v1::UpdateBatch heap = insert_balls(1, kObjects);
    heap.mutable_inserts(0)->clear_positions();
    heap.mutable_inserts(0)->mutable_positions()->Resize(3 * kObjects, 0.0f);
    ASSERT_TRUE(apply(heap).ok());
  }

  // Returns a batch whose queries test every object: seconds of work if the scene has many objects.
  static v1::QueryBatch heavy_batch(int queries = limits::kMaxQueries) {
    v1::QueryBatch batch;
    v1::QueryBlock* block = batch.add_blocks();
    block->set_max_results(1);
    block->mutable_balls()->mutable_centers()->Resize(3 * queries, 0.0f);
    block->mutable_balls()->add_radii(10);
    return batch;
  }
  // Returns a batch with an answer of about 4 MB and little work.
  static v1::QueryBatch long_answer() {
    v1::QueryBatch batch;
    batch.add_blocks()->mutable_lookup()->mutable_ids()->Resize(40'000, 1);
    return batch;
  }

  static v1::StreamQueriesRequest message(uint64_t sequence, const v1::QueryBatch& batch) {
    v1::StreamQueriesRequest request;
    request.set_scene("world");
    request.set_sequence(sequence);
    *request.mutable_batch() = batch;
    return request;
  }

  double used(const std::string& limit) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse server;
    EXPECT_TRUE(stubs().server->GetServer(&context, {}, &server).ok());
    for (const v1::Limit& each : server.limits())
      if (each.name() == limit) return each.used();
    ADD_FAILURE() << "no limit " << limit;
    return 0;
  }

  // Waits until the server has no calls or streams. used("calls") counts the call that reads it, so it is at least 1.
  void wait_until_nothing_is_in_work() {
    while (used("calls") > 1 || used("streams") > 0) std::this_thread::sleep_for(kPatience);
  }

  void expect_a_good_caller_is_answered() {
    v1::QueryResult result;
    const grpc::Status status = query(ray_along_x(), &result);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(result.blocks(0).ids_size(), 1);
  }

  void give_up_calls(int count);
  void come_and_go(int connections, int rounds);
};

int open_files() {
  DIR* const folder = opendir("/proc/self/fd");
  int files = 0;
  while (readdir(folder) != nullptr) ++files;
  closedir(folder);
  return files;
}

TEST_F(FaultTest, ADeadlineEndsLongWorkAndReleasesItsResources) {
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    set_timeout(context, std::chrono::milliseconds(1));
    v1::QueryRequest request;
    request.set_scene("world");
    *request.mutable_batch() = heavy_batch();
    v1::QueryResponse response;
    EXPECT_EQ(stubs().queries->Query(&context, request, &response).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  wait_until_nothing_is_in_work();
  EXPECT_EQ(get("world").pinned_bytes(), 0u);
  expect_a_good_caller_is_answered();
}

// Makes and cancels calls with up to eight unanswered messages: half of the calls send batches that take long, the
// other half wait for a revision that is never reached. Every third call also sends an empty batch and reads one
// answer.
void FaultTest::give_up_calls(int count) {
  v1::QueryBatch waiting;
  waiting.mutable_view()->set_at_least(99);
  for (int i = 0; i < count; ++i) {
    grpc::ClientContext context;
    set_timeout(context);
    const std::unique_ptr<QueryStream> stream = stubs().queries->StreamQueries(&context);
    const int messages = i % 9;  // 0 to 8; a stream processes up to 8 messages at once
    for (int m = 1; m <= messages; ++m) stream->Write(message(m, i % 2 == 0 ? heavy_batch(8192) : waiting));
    if (i % 3 == 0) stream->Write(message(99, {}));
    v1::StreamQueriesResponse response;
    if (i % 3 == 0 && messages < 8) stream->Read(&response);
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  wait_until_nothing_is_in_work();
  EXPECT_EQ(get("world").pinned_bytes(), 0u);
  expect_a_good_caller_is_answered();
}

TEST_F(FaultTest, CancelledCallsReleaseTheirResources) { give_up_calls(static_cast<int>(scaled_count(200))); }

TEST_F(FaultTest, ACallerThatDoesNotReadIsNotReadFromAndOthersAreAnswered) {
  constexpr uint64_t kMessages = 200;  // 64 MB of requests, of which sockets buffer about 10 MB
  grpc::ClientContext context;
  set_timeout(context, kNoHurry);
  const std::unique_ptr<QueryStream> stream = stubs().queries->StreamQueries(&context);
  std::atomic<uint64_t> written{0};
  std::thread writer([&] {
    for (uint64_t i = 1; i <= kMessages; ++i) {
      EXPECT_TRUE(stream->Write(message(i, long_answer())));
      written = i;
    }
    stream->WritesDone();
  });
  // Wait until no more messages are written. If the server continued to read, all messages would be written.
  uint64_t before = 0;
  do {
    before = written;
    expect_a_good_caller_is_answered();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  } while (written == 0 || written != before);
  EXPECT_LT(before, kMessages / 2);
  // Expect an answer to every message.
  std::vector<uint64_t> answered;
  v1::StreamQueriesResponse response;
  while (stream->Read(&response)) {
    EXPECT_EQ(response.result().blocks(0).ids_size(), 40'000);
    answered.push_back(response.sequence());
  }
  writer.join();
  EXPECT_TRUE(stream->Finish().ok());
  std::sort(answered.begin(), answered.end());
  EXPECT_EQ(answered.size(), kMessages);
  EXPECT_EQ(std::unique(answered.begin(), answered.end()), answered.end());
}

// Raises the limit on open files: both ends of every connection are files of this process.
void allow_many_files() {
  rlimit limit;
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = limit.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
}

// Opens connections with one stream each. Some streams end normally, some are cancelled, some lose their connection.
void FaultTest::come_and_go(int connections, int rounds) {
  allow_many_files();
  expect_a_good_caller_is_answered();
  const int files_before = open_files();
  for (int round = 0; round < rounds; ++round) {
    struct Guest {
      explicit Guest(const std::string& address) : stubs(address) {}
      Stubs stubs;
      grpc::ClientContext context;
      std::unique_ptr<QueryStream> stream;
    };
    std::vector<std::unique_ptr<Guest>> guests;
    for (int i = 0; i < connections; ++i) {
      Guest& guest = *guests.emplace_back(std::make_unique<Guest>(running_.address()));
      set_timeout(guest.context, kNoHurry);
      guest.stream = guest.stubs.queries->StreamQueries(&guest.context);
      v1::StreamQueriesResponse response;
      ASSERT_TRUE(guest.stream->Write(message(1, ray_along_x())));
      ASSERT_TRUE(guest.stream->Read(&response));
      if (i % 4 == 0) guest.stream->Write(message(2, heavy_batch(1024)));
    }
    EXPECT_EQ(used("streams"), connections);
    expect_a_good_caller_is_answered();
    for (size_t i = 0; i < guests.size(); ++i) {
      if (i % 4 == 3) guests[i]->stream->WritesDone();
      if (i % 4 != 3) guests[i]->context.TryCancel();
      EXPECT_EQ(guests[i]->stream->Finish().ok(), i % 4 == 3);
    }
  }
  wait_until_nothing_is_in_work();
  // Sockets close shortly after their streams.
  while (open_files() > files_before + 4) std::this_thread::sleep_for(kPatience);
  EXPECT_EQ(get("world").pinned_bytes(), 0u);
  expect_a_good_caller_is_answered();
}

TEST_F(FaultTest, ClosedConnectionsAndStreamsReleaseTheirResources) { come_and_go(40, 2); }

class FewCallsFaultTest : public FaultTest {
 protected:
  FewCallsFaultTest()
      : FaultTest([] {
          server::ServerConfig config = test_config();
          config.max_calls = 4;
          return config;
        }()) {}
};

TEST_F(FewCallsFaultTest, RefusedCallersThatRetryAreAllAnswered) {
  constexpr int kCallers = 12;
  std::atomic<int> answered{0};
  std::vector<std::thread> callers;
  for (int i = 0; i < kCallers; ++i)
    callers.emplace_back([&] {
      for (int times = 0; times < 3;) {
        const grpc::Status status = query(heavy_batch(16));
        if (status.ok()) {
          ++times;
          ++answered;
          continue;
        }
        const v1::Error error = error_of(status);
        ASSERT_EQ(error.reason(), v1::REASON_LIMIT) << error.ShortDebugString();
        EXPECT_EQ(error.limit(), "calls");
        EXPECT_GT(error.retry_after_ms(), 0u);
        std::this_thread::sleep_for(std::chrono::milliseconds(error.retry_after_ms()));
      }
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(answered, 3 * kCallers);
  wait_until_nothing_is_in_work();
}

// One address opens a thousand connections at once, more than the default limits admit.
class LongFaultTest : public FaultTest {
 protected:
  LongFaultTest()
      : FaultTest([] {
          server::ServerConfig config = test_config();
          config.max_connections_per_address = 4096;
          config.max_new_connections = 4096;
          return config;
        }()) {}
};

TEST_F(LongFaultTest, AThousandCancelledCallsReleaseTheirResources) { give_up_calls(1000); }

TEST_F(LongFaultTest, AThousandClosedConnectionsReleaseTheirResources) { come_and_go(1000, 3); }

}  // namespace
}  // namespace locus::test
