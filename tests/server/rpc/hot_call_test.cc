// Calls on completion queues that end after each of their events in turn: by the caller, by a broken connection, by the
// server. AddressSanitizer detects leaks, and the test's time limit detects calls that hang.
#include "server/rpc/hot_call.h"

#include <fcntl.h>
#include <grpcpp/create_channel_posix.h>
#include <grpcpp/server_posix.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>
#include <list>
#include <set>

#include "locus/v1/query_service.grpc.pb.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using server::CallSlot;
using server::Host;
using server::IoLoop;
using server::IoThreads;
using server::Listener;
using server::MemberTag;

// Behaviour of the work on a message, chosen by the message's max_work.
enum What : uint64_t {
  kAtOnce = 1,     // answers before begin() returns
  kElsewhere = 2,  // answers after another thread has posted
  kHeld = 3,       // answers when give_up() is called, or when a message kLetGo arrives
  kLetGo = 4,      // makes all held work answer, then answers
  kRefused = 5,
  kHoldsOthers = 6,  // like kElsewhere, and stops the call from reading meanwhile
  kAside = 7,        // answers as a deferred task
};

// Work with a chosen behaviour.
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

using Service =
    v1::QueryService::WithRawMethod_Query<v1::QueryService::WithRawMethod_StreamQueries<v1::QueryService::Service>>;

struct Unary {
  using Request = v1::QueryRequest;
  using Response = v1::QueryResponse;
  using Work = FakeWork;
  static constexpr server::Rpc kRpc = server::Rpc::kQuery;
  static constexpr bool kStream = false;
  static constexpr bool kInOrder = false;
  void listen(grpc::ServerContext* context, grpc::ByteBuffer* request,
              grpc::ServerAsyncResponseWriter<grpc::ByteBuffer>* wire, grpc::ServerCompletionQueue* queue,
              void* tag) const {
    service->RequestQuery(context, request, wire, queue, queue, tag);
  }
  void begin(Work& work, const std::string&, const Request& request, Response&) const {
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
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = kOrdered;
  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamQueries(context, wire, queue, queue, tag);
  }
  void begin(Work& work, const std::string&, const Request& request, Response& response) const {
    response.mutable_result();
    work.begin(request.batch().max_work());
  }
  Service* service;
};

// A server with one connection and one IO loop, whose turns the test takes on its own thread.
template <class Stream>
class Bench {
 public:
  Bench() : host_(test_config(), nullptr) {
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    io_ = std::make_unique<IoThreads>(builder, 1);
    server_ = builder.BuildAndStart();
    unary_.emplace(host_, Unary{&service_}, io());
    stream_.emplace(host_, Stream{&service_}, io());
    unary_->listen();
    stream_->listen();
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    for (const int end : ends) fcntl(end, F_SETFL, O_NONBLOCK);
    client_end_ = dup(ends[1]);
    grpc::AddInsecureChannelFromFd(server_.get(), ends[0]);
    channel_ = grpc::CreateInsecureChannelFromFd("bench", ends[1]);
    stub_ = v1::QueryService::NewStub(channel_);
  }
  ~Bench() {
    end();
    close(client_end_);
  }

  // Shuts the server down.
  void end() {
    host_.drain.end();
    // Shutdown() blocks until all calls have ended, and calls need turns of the loop to end.
    std::thread shutdown([this] { server_->Shutdown(std::chrono::system_clock::now()); });
    while (!io().empty()) io().turn();
    shutdown.join();
    io_->stop();
  }

  IoLoop& io() { return io_->loop(0); }
  Host& host() { return host_; }
  v1::QueryService::Stub& stub() { return *stub_; }

  void drain() {
    host_.drain.begin();
    io_->drain();
  }
  void break_connection() { shutdown(client_end_, SHUT_RDWR); }

  // Runs `client` on a thread, takes `before` turns, interrupts, and takes turns until the client has ended and no call
  // is left. Returns false if the client ended before the interruption.
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

  Host host_;
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

// Messages of a client's stream, and the answers to them.
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

// Holds conversations that are interrupted after 0, 1, 2, ... events, until one ends before its interruption.
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
    EXPECT_EQ(bench.host().streams.used(), 0u);
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
        // The answered messages must be the first ones, each once.
        std::sort(conversation.answers.begin(), conversation.answers.end());
        for (size_t i = 0; i < conversation.answers.size(); ++i) EXPECT_EQ(conversation.answers[i], i + 1);
      });
}

TEST(UnaryHotCallTest, ACallMayEndInAnyWayAfterAnyEvent) {
  for (const uint64_t what : {kAtOnce, kElsewhere, kHeld, kRefused, kAside})
    for (const char* how : {"cancel", "break", "drain"}) {
      bool in_time = true;
      // A held call has one event before its end: its arrival.
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
        EXPECT_EQ(bench.host().calls.used(), 0u);
      }
    }
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
    // The delays end the server from before the call arrives until long after. The call stays in the queue meanwhile,
    // because no turn is taken.
    std::this_thread::sleep_for(std::chrono::microseconds(100 * i));
    bench.end();
    client.join();
    EXPECT_TRUE(bench.io().empty());
    EXPECT_EQ(bench.host().calls.used(), 0u);
  }
}

}  // namespace
}  // namespace locus::test
