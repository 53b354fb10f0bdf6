// Updates through a proxy, HAProxy, that repeats a call if it gets no answer: each numbered batch is applied once. The
// network between the proxy and the daemon loses answers of the daemon.
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "client/lib/update_stream.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/lossy_relay.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

constexpr const char* kProxyProgram = "/usr/sbin/haproxy";

class ProxyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(access(kProxyProgram, X_OK), 0) << "deploy/packages.sh test installs haproxy";
    daemon_.start();
    create_scene(daemon_.stubs(), "arena");
    relay_ = std::make_unique<LossyRelay>(daemon_.port());
    std::ofstream(folder_.file("haproxy.cfg"))
        << "defaults\n"
           "  mode http\n"
           "  timeout connect 5s\n"
           "  timeout client 1h\n"
           "  timeout server 1h\n"
           "  retries 3\n"
           "  retry-on conn-failure empty-response\n"
           "listen locus\n"
           "  bind unix@"
        << socket() << " proto h2\n  server one 127.0.0.1:" << relay_->port() << " proto h2\n";
    proxy_ = std::make_unique<ChildProcess>(
        kProxyProgram, std::vector<std::string>{"-f", folder_.file("haproxy.cfg"), "-db"}, folder_.file("haproxy.log"));
    for (int i = 0; i < 500 && access(socket().c_str(), F_OK) != 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(access(socket().c_str(), F_OK), 0) << text_of(folder_.file("haproxy.log"));
    proxied_ = std::make_unique<Stubs>("unix:" + socket());
  }

  std::string socket() const { return folder_.file("proxy.sock"); }

  static v1::UpdateBatch point(uint64_t id) {
    v1::UpdateBatch batch;
    v1::Insert* const insert = batch.add_inserts();
    insert->mutable_point();
    insert->add_ids(id);
    for (const double x : {static_cast<double>(id), 0.0, 0.0}) insert->add_positions_f64(x);
    return batch;
  }

  v1::UpdateAck apply(const v1::UpdateBatch& batch) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::ApplyUpdatesRequest request;
    request.set_scene("arena");
    *request.mutable_batch() = batch;
    v1::ApplyUpdatesResponse response;
    const grpc::Status status = proxied_->updates->ApplyUpdates(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.ack();
  }

  TemporaryFolder folder_;
  KeptDaemon daemon_;
  std::unique_ptr<LossyRelay> relay_;
  std::unique_ptr<ChildProcess> proxy_;
  std::unique_ptr<Stubs> proxied_;
};

// Shows the problem that batch numbers solve.
TEST_F(ProxyTest, AnUnnumberedBatchIsAppliedAgainIfItsAnswerIsLost) {
  EXPECT_EQ(apply(point(1)).revision(), 1u);
  relay_->lose_one();
  const v1::UpdateAck ack = apply(point(2));
  EXPECT_EQ(relay_->lost(), 1u);
  EXPECT_EQ(ack.refused(), 1u) << "its id is there already";
  EXPECT_FALSE(ack.duplicate());
}

TEST_F(ProxyTest, ANumberedBatchIsAppliedOnce) {
  for (uint64_t number = 1; number <= 20; ++number) {
    v1::UpdateBatch batch = point(number);
    batch.set_writer(7);
    batch.set_batch(number);
    const bool lose = number % 2 == 0;
    if (lose) relay_->lose_one();
    const v1::UpdateAck ack = apply(batch);
    EXPECT_EQ(ack.duplicate(), lose);
    EXPECT_EQ(ack.refused(), 0u);
    EXPECT_EQ(ack.revision(), number);
  }
  EXPECT_EQ(relay_->lost(), 10u);
  EXPECT_EQ(points_of(daemon_.stubs(), "arena").size(), 20u);
}

// The client library's stream resends unacknowledged batches after a connection breaks and after the daemon is killed.
TEST_F(ProxyTest, AStreamAppliesEachBatchOnceDespiteBrokenConnectionsAndKills) {
  constexpr uint64_t kBatches = 400;
  auto client = client::Client::connect("unix:" + socket());
  ASSERT_TRUE(client.ok()) << client.status();
  client::UpdateStreamOptions options;
  options.reconnect = {
      .max_attempts = 1000, .first_backoff = absl::Milliseconds(5), .max_backoff = absl::Milliseconds(50)};
  const auto stream = (*client)->update_stream("arena", options);
  relay_->lose_every(13);
  std::vector<std::future<absl::StatusOr<v1::UpdateAck>>> acks;
  for (uint64_t number = 1; number <= kBatches; ++number) {
    if (number == kBatches / 3 || number == 2 * kBatches / 3) {
      daemon_.kill();
      daemon_.start();
      relay_->set_server(daemon_.port());
    }
    acks.push_back(stream->send(point(number)));
  }
  for (uint64_t number = 1; number <= kBatches; ++number) {
    const absl::StatusOr<v1::UpdateAck> ack = acks[number - 1].get();
    ASSERT_TRUE(ack.ok()) << number << ": " << ack.status();
    EXPECT_EQ(ack->refused(), 0u) << number;
    // If a batch is sent again after it was applied, its ack is a duplicate with the scene's current revision, so the
    // revision may be higher than `number`.
    EXPECT_GE(ack->revision(), number);
    EXPECT_TRUE(ack->duplicate() || ack->revision() == number) << number;
  }
  EXPECT_GT(relay_->lost(), 10u);
  EXPECT_EQ(points_of(daemon_.stubs(), "arena").size(), kBatches);
  EXPECT_EQ(get_scene(daemon_.stubs(), "arena").revision(), kBatches);
}

}  // namespace
}  // namespace locus::test
