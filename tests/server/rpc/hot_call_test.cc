// Tests of calls on completion queues. A call is ended after any number of its events: by the caller, by a broken
// connection, or by the server. AddressSanitizer detects leaks, and the test's time limit detects calls that hang.
#include "server/rpc/hot_call.h"

#include <fcntl.h>
#include <grpcpp/create_channel_posix.h>
#include <grpcpp/server_posix.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>
#include <list>
#include <map>
#include <set>

#include "locus/v1/query_service.grpc.pb.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using server::CallSlot;
using server::IoLoop;
using server::IoThreads;
using server::Listener;
using server::MemberTag;
using server::RpcState;

// Behaviour of the server's work on a message. The client selects the behaviour by the message's max_work.
enum What : uint64_t {
  kAtOnce = 1,     // answers within begin()
  kElsewhere = 2,  // answers in an event that another thread posts
  kHeld = 3,       // answers when give_up() is called, or when a message kLetGo arrives
  kLetGo = 4,      // makes all work of kHeld answer, then answers itself
  kRefused = 5,
  kHoldsOthers = 6,  // like kElsewhere, and the call reads no messages before that event
  kAside = 7,        // answers as a deferred task
  kBulky = 8,        // like kAtOnce, with an answer that no flow control window holds
};
constexpr size_t kBulkyBytes = 3u << 20;

// Work on a message, with one of the behaviours What.
class FakeWork : private server::DeferredTask {
 public:
  explicit FakeWork(CallSlot& slot) : slot_(slot) {}
  ~FakeWork() {
    if (thread_.joinable()) thread_.join();
  }

  void begin(uint64_t what) {
    if (thread_.joinable()) thread_.join();
    if (what == kHoldsOthers) slot_.hold();
    if (what == kElsewhere || what == kHoldsOthers) {
      thread_ = std::thread([this, &io = slot_.io()] { io.post(returned_); });
    } else if (what == kAside) {
      slot_.io().defer(*this, server::TaskLength::kLong);
    } else if (what == kHeld) {
      place_ = held_.insert(held_.end(), this);
    } else {
      while (what == kLetGo && !held_.empty()) held_.front()->let_go(absl::OkStatus());
      slot_.answered(what == kRefused ? absl::InvalidArgumentError("refused") : absl::OkStatus());
    }
  }

  void give_up() {
    if (place_) let_go(slot_.caller().stop());
  }

 private:
  void let_go(const absl::Status& status) {
    held_.erase(*place_);
    place_.reset();
    slot_.answered(status);
  }
  void returned(bool) { slot_.answered(absl::OkStatus()); }
  void run_deferred() override {}
  void on_deferred_done() override { slot_.answered(absl::OkStatus()); }

  static inline std::list<FakeWork*> held_;

  CallSlot& slot_;
  std::optional<std::list<FakeWork*>::iterator> place_;
  std::thread thread_;
  MemberTag<FakeWork> returned_{*this, &FakeWork::returned};
};

void fill_up(v1::QueryResult& result) {
  result.add_blocks()->mutable_ids()->Resize(static_cast<int>(kBulkyBytes / sizeof(uint64_t)), 1);
}

using Service =
    v1::QueryService::WithRawMethod_Query<v1::QueryService::WithRawMethod_StreamQueries<v1::QueryService::Service>>;

struct Unary {
  using Request = v1::QueryRequest;
  using Response = v1::QueryResponse;
  using Work = FakeWork;
  static constexpr server::Rpc kRpc = server::Rpc::kQuery;
  static constexpr const char* kPath = "/locus.v1.QueryService/Query";
  static constexpr bool kStream = false;
  static constexpr bool kInOrder = false;
  void listen(grpc::ServerContext* context, grpc::ByteBuffer* request,
              grpc::ServerAsyncResponseWriter<grpc::ByteBuffer>* wire, grpc::ServerCompletionQueue* queue,
              void* tag) const {
    service->RequestQuery(context, request, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(slot); }
  static bool is_change(const Request&, const Response&) { return false; }
  void begin(Work& work, const std::string&, const Request& request, Response& response) const {
    if (request.batch().max_work() == kBulky) fill_up(*response.mutable_result());
    work.begin(request.batch().max_work());
  }
  Service* service;
};

template <bool kOrdered>
struct Streamed {
  using Request = v1::StreamQueriesRequest;
  using Response = v1::StreamQueriesResponse;
  using Work = FakeWork;
  static constexpr server::Rpc kRpc = server::Rpc::kStreamQueries;
  static constexpr const char* kPath = "/locus.v1.QueryService/StreamQueries";
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = kOrdered;
  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamQueries(context, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(slot); }
  static bool is_change(const Request&, const Response&) { return false; }
  void begin(Work& work, const std::string&, const Request& request, Response& response) const {
    response.mutable_result();
    if (request.batch().max_work() == kBulky) fill_up(*response.mutable_result());
    work.begin(request.batch().max_work());
  }
  Service* service;
};

// A server with one connection and one IO loop. No server thread runs the loop: the test's thread calls turn().
template <class Stream>
class Bench {
 public:
  Bench() {
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    io_ = std::make_unique<IoThreads>(builder, 1);
    server_ = builder.BuildAndStart();
    unary_.emplace(state_, Unary{&service_}, io());
    stream_.emplace(state_, Stream{&service_}, io());
    unary_->listen();
    stream_->listen();
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    for (const int end : ends) fcntl(end, F_SETFL, O_NONBLOCK);
    client_end_ = dup(ends[1]);
    grpc::AddInsecureChannelFromFd(server_.get(), ends[0]);
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);  // flow control windows that do not grow
    channel_ = grpc::CreateCustomInsecureChannelFromFd("bench", ends[1], arguments);
    stub_ = v1::QueryService::NewStub(channel_);
  }
  ~Bench() {
    end();
    close(client_end_);
  }

  // Shuts the server down.
  void end() {
    state_.drain.end();
    // Shutdown() runs on its own thread: it blocks until all calls have ended, and calls need turns of the loop to end.
    std::thread shutdown([this] { server_->Shutdown(std::chrono::system_clock::now()); });
    while (!io().empty()) io().turn();
    shutdown.join();
    io_->stop();
  }

  IoLoop& io() { return io_->loop(0); }
  RpcState& state() { return state_; }
  v1::QueryService::Stub& stub() { return *stub_; }

  // Runs `client` on a new thread. Meanwhile runs turns of the loop on this thread until a call has arrived and all
  // calls have ended. Then calls `ended`, and runs further turns until the client has ended.
  void serve_until_idle(const std::function<void()>& client, const std::function<void()>& ended) {
    std::atomic<bool> over{false};
    std::thread thread([&] {
      client();
      over = true;
      io().post(nudge_);
    });
    while (io().idle()) io().turn();
    while (!io().idle()) io().turn();
    ended();
    while (!over) io().turn();
    thread.join();
  }

  void drain() {
    state_.drain.begin();
    io_->drain();
  }
  // Leaves no memory except the reserve of small claims.
  void fill_memory() {
    memory_used_ = limits::kMaxMemory;
    state_.memory.refresh();
  }
  void break_connection() { shutdown(client_end_, SHUT_RDWR); }

  // Runs `client` on a new thread. Runs `before` turns of the loop, calls `interruption`, and runs further turns until
  // the client has ended and the loop has no calls. Returns false if the client ended before the interruption.
  template <class Interruption>
  bool interrupt(int before, const std::function<void()>& client, const Interruption& interruption) {
    std::atomic<bool> over{false};
    std::thread thread([&] {
      client();
      over = true;
      io().post(nudge_);
    });
    for (int turns = 0; turns < before && !over; ++turns) io().turn();
    const bool in_time = !over;
    if (in_time) interruption();
    while (!over || !io().idle()) io().turn();
    thread.join();
    return in_time;
  }

 private:
  void nudged(bool) {}

  std::atomic<uint64_t> memory_used_{0};
  RpcState state_{limits::kMaxCalls, limits::kMaxStreams, limits::kMaxMemory, [this] { return memory_used_.load(); }};
  Service service_;
  std::unique_ptr<IoThreads> io_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<Listener<Unary>> unary_;
  std::optional<Listener<Stream>> stream_;
  int client_end_ = -1;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::QueryService::Stub> stub_;
  MemberTag<Bench> nudge_{*this, &Bench::nudged};
};

v1::StreamQueriesRequest message(uint64_t sequence, uint64_t what) {
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  request.set_sequence(sequence);
  request.mutable_batch()->set_max_work(what);
  return request;
}

// A client's stream: the messages that hold() sends, and the sequence numbers of the answers.
struct Conversation {
  std::vector<uint64_t> messages = {kAtOnce, kElsewhere, kHeld, kRefused, kAside, kHoldsOthers, kAtOnce, kHeld, kLetGo};
  grpc::ClientContext context;
  std::vector<uint64_t> answers;
  grpc::Status status;

  void hold(v1::QueryService::Stub& stub) {
    set_timeout(context);
    const auto stream = stub.StreamQueries(&context);
    for (size_t i = 0; i < messages.size(); ++i)
      if (!stream->Write(message(i + 1, messages[i]))) break;
    stream->WritesDone();
    v1::StreamQueriesResponse response;
    while (stream->Read(&response)) answers.push_back(response.sequence());
    status = stream->Finish();
  }
};

// Runs one conversation after another, interrupted after 0, 1, 2, ... events, until a conversation ends before its
// interruption.
template <class Stream, class Interruption, class Check>
void after_every_event(const Interruption& interruption, const Check& check) {
  bool in_time = true;
  for (int before = 0; in_time; ++before) {
    SCOPED_TRACE(before);
    Bench<Stream> bench;
    Conversation conversation;
    in_time = bench.interrupt(
        before, [&] { conversation.hold(bench.stub()); }, [&] { interruption(bench, conversation); });
    check(conversation);
    EXPECT_EQ(bench.state().streams.used(), 0u);
  }
}

template <class Stream>
class HotCallTest : public ::testing::Test {};
using Orders = ::testing::Types<Streamed<false>, Streamed<true>>;
TYPED_TEST_SUITE(HotCallTest, Orders);

TYPED_TEST(HotCallTest, EveryMessageIsAnsweredOnceInTheOrderOfTheRpc) {
  Bench<TypeParam> bench;
  Conversation conversation;
  bench.interrupt(
      0, [&] { conversation.hold(bench.stub()); }, [] {});
  EXPECT_TRUE(conversation.status.ok()) << conversation.status.error_message();
  EXPECT_EQ(conversation.answers.size(), conversation.messages.size());
  EXPECT_EQ(std::set<uint64_t>(conversation.answers.begin(), conversation.answers.end()).size(),
            conversation.messages.size());
  const bool sorted = std::is_sorted(conversation.answers.begin(), conversation.answers.end());
  EXPECT_EQ(sorted, TypeParam::kInOrder);
}

TYPED_TEST(HotCallTest, AMessageThatIsRefusedUnreadIsAnsweredUnderItsSequenceAndTheStreamContinues) {
  Bench<TypeParam> bench;
  bench.fill_memory();
  std::map<uint64_t, v1::Error> errors;
  grpc::Status status;
  bench.interrupt(
      0,
      [&] {
        grpc::ClientContext context;
        set_timeout(context);
        const auto stream = bench.stub().StreamQueries(&context);
        v1::StreamQueriesRequest large = message(1, kAtOnce);
        large.mutable_batch()->add_blocks()->mutable_rays()->mutable_origins()->Resize(300'000, 0.f);
        stream->Write(large);
        v1::StreamQueriesRequest many = message(2, kAtOnce);
        many.clear_scene();
        for (uint32_t i = 0; i <= limits::kMaxBlocks; ++i) many.mutable_batch()->add_blocks();
        stream->Write(many);
        stream->Write(message(3, kAtOnce));
        stream->WritesDone();
        v1::StreamQueriesResponse response;
        while (stream->Read(&response)) errors[response.sequence()] = response.error();
        status = stream->Finish();
      },
      [] {});
  EXPECT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_EQ(errors[1].limit(), "memory_bytes");
  EXPECT_GT(errors[1].retry_after_ms(), 0u);
  EXPECT_EQ(errors[2].limit(), "blocks");
  EXPECT_EQ(errors[3].code(), 0);
}

TYPED_TEST(HotCallTest, ACallerMayGiveUpAfterAnyEventOfItsStream) {
  after_every_event<TypeParam>([](auto&, Conversation& conversation) { conversation.context.TryCancel(); },
                               [](const Conversation& conversation) {
                                 if (conversation.status.ok()) return;
                                 EXPECT_EQ(conversation.status.error_code(), grpc::StatusCode::CANCELLED);
                               });
}

TYPED_TEST(HotCallTest, TheConnectionMayBreakAfterAnyEventOfAStream) {
  after_every_event<TypeParam>([](auto& bench, Conversation&) { bench.break_connection(); },
                               [](const Conversation&) {});
}

TYPED_TEST(HotCallTest, TheServerMayDrainAfterAnyEventOfAStreamAndAnswersTheMessagesItRead) {
  after_every_event<TypeParam>(
      [](auto& bench, Conversation&) { bench.drain(); },
      [](Conversation& conversation) {
        if (!conversation.status.ok())
          expect_refused(conversation.status, {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
        // The answered messages must be the first messages of the stream, each answered once.
        std::sort(conversation.answers.begin(), conversation.answers.end());
        for (size_t i = 0; i < conversation.answers.size(); ++i) EXPECT_EQ(conversation.answers[i], i + 1);
      });
}

TEST(UnaryHotCallTest, ACallMayEndInAnyWayAfterAnyEvent) {
  for (const uint64_t what : {kAtOnce, kElsewhere, kHeld, kRefused, kAside})
    for (const char* how : {"cancel", "break", "drain"}) {
      bool in_time = true;
      // Before its end, a call of kHeld has only one event: its arrival. So later interruptions would wait for ever.
      for (int before = 0; in_time && (what != kHeld || before < 2); ++before) {
        SCOPED_TRACE(testing::Message() << how << " " << what << " after " << before);
        Bench<Streamed<false>> bench;
        grpc::ClientContext context;
        set_timeout(context);
        in_time = bench.interrupt(
            before,
            [&] {
              v1::QueryRequest request;
              request.mutable_batch()->set_max_work(what);
              v1::QueryResponse response;
              bench.stub().Query(&context, request, &response);
            },
            [&] {
              if (how == std::string("cancel")) context.TryCancel();
              if (how == std::string("break")) bench.break_connection();
              if (how == std::string("drain")) bench.drain();
            });
        EXPECT_EQ(bench.state().calls.used(), 0u);
      }
    }
}

TYPED_TEST(HotCallTest, AStreamWhoseAnswersNobodyReadsIsCancelledAndReturnsItsMemory) {
  Bench<TypeParam> bench;
  bench.state().stall_limit = std::chrono::milliseconds(1);
  std::promise<void> ended;
  grpc::Status status;
  bench.serve_until_idle(
      [&] {
        grpc::ClientContext context;
        set_timeout(context);
        const auto stream = bench.stub().StreamQueries(&context);
        stream->Write(message(1, kBulky));
        ended.get_future().wait();
        v1::StreamQueriesResponse response;
        while (stream->Read(&response)) {
        }
        status = stream->Finish();
      },
      [&] { ended.set_value(); });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(bench.state().streams.used(), 0u);
  EXPECT_EQ(bench.state().memory.claimed(server::MemoryLine::kReplies), 0u);
}

TEST(UnaryHotCallTest, ACallMayArriveWhileTheServerEnds) {
  for (int i = 0; i < 40; ++i) {
    Bench<Streamed<false>> bench;
    std::thread client([&] {
      grpc::ClientContext context;
      set_timeout(context);
      v1::QueryRequest request;
      request.mutable_batch()->set_max_work(kElsewhere);
      v1::QueryResponse response;
      bench.stub().Query(&context, request, &response);
    });
    // Because of the different delays, the server ends before the call arrives, at about the same time, or long after
    // the arrival. A call that has arrived stays in the completion queue until end(), because the loop runs no turn
    // before end().
    std::this_thread::sleep_for(std::chrono::microseconds(100 * i));
    bench.end();
    client.join();
    EXPECT_TRUE(bench.io().empty());
    EXPECT_EQ(bench.state().calls.used(), 0u);
  }
}

}  // namespace
}  // namespace locus::test
