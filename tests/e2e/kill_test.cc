// A daemon that is killed at random moments under load recovers every batch that it acknowledged. No batch is applied
// twice or out of order, and nothing of a batch of several messages shows without the rest of it. The suite named
// Long... kills the daemon 100 times, or LOCUS_FAULT_RUNS times.
#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/support/kept_daemon.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr int kScenes = 2;
constexpr uint64_t kWindow = 16;  // maximum number of unanswered batches of a writer
constexpr uint64_t kKept = 50;    // number of latest batches whose points are in the scene

std::string scene_name(uint64_t writer) { return "arena-" + std::to_string(writer % kScenes); }
uint64_t id_of(uint64_t writer, uint64_t batch) { return writer << 32 | batch; }

// A writer whose applied batches can be read from the scene. Each batch inserts a point of its own, removes the point
// of the batch that is kKept batches older, and moves a counter point to x = the batch's number. Batch 1 inserts the
// counter point.
class Writer {
 public:
  explicit Writer(uint64_t number) : number_(number) {}

  uint64_t acknowledged() const { return acknowledged_; }

  v1::UpdateBatch batch(uint64_t k) const {
    v1::UpdateBatch batch;
    batch.set_writer(number_);
    batch.set_batch(k);
    v1::Insert* own = batch.add_inserts();
    own->mutable_point();
    own->add_ids(id_of(number_, k));
    for (const double x : {static_cast<double>(k), static_cast<double>(number_), 0.0}) own->add_positions_f64(x);
    if (k > kKept) batch.add_remove_ids(id_of(number_, k - kKept));
    const double at[] = {static_cast<double>(k), static_cast<double>(number_), 1.0};
    if (k == 1) {
      v1::Insert* counter = batch.add_inserts();
      counter->mutable_point();
      counter->add_ids(id_of(number_, 0));
      for (const double x : at) counter->add_positions_f64(x);
    } else {
      v1::Move* move = batch.add_moves();
      move->add_ids(id_of(number_, 0));
      for (const double x : at) move->add_positions_f64(x);
    }
    return batch;
  }

  // Returns the messages in which batch `k` is sent. Two of three writers send several messages for each batch.
  std::vector<v1::UpdateBatch> messages(uint64_t k) const {
    v1::UpdateBatch whole = batch(k);
    std::vector<v1::UpdateBatch> messages;
    if (number_ % 3 != 0) {
      v1::UpdateBatch inserts, removes;
      inserts.mutable_inserts()->Swap(whole.mutable_inserts());
      removes.mutable_remove_ids()->Swap(whole.mutable_remove_ids());
      for (v1::UpdateBatch* message : {&inserts, &removes}) message->set_continues(true);
      messages = {inserts, removes};
    }
    messages.push_back(std::move(whole));
    return messages;
  }

  // Returns the points of this writer that the scene must contain if batch `k` was the last applied batch.
  std::map<uint64_t, PlacedPoint> model(uint64_t k) const {
    std::map<uint64_t, PlacedPoint> points;
    if (k > 0) points[id_of(number_, 0)] = {static_cast<double>(k), static_cast<double>(number_), 1};
    for (uint64_t i = k > kKept ? k - kKept + 1 : 1; i <= k; ++i)
      points[id_of(number_, i)] = {static_cast<double>(i), static_cast<double>(number_), 0};
    return points;
  }

  // Sends batches, beginning with the first that is not acknowledged, until the connection breaks or batch `enough` is
  // acknowledged.
  void write(Stubs& stubs, uint64_t enough) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = stubs.updates->StreamUpdates(&context);
    uint64_t sent = acknowledged_;
    v1::StreamUpdatesRequest request;
    request.set_scene(scene_name(number_));
    v1::StreamUpdatesResponse response;
    while (acknowledged_ < enough) {
      while (sent < std::min(acknowledged_ + kWindow, enough)) {
        request.set_sequence(++sent);
        for (v1::UpdateBatch& message : messages(sent)) {
          max_sent_ = std::max(max_sent_, sent);
          *request.mutable_batch() = std::move(message);
          if (!stream->Write(request)) return;
          request.clear_scene();
        }
      }
      if (!stream->Read(&response)) return;
      take(response);
    }
    stream->WritesDone();
  }

  // Verifies this writer's points in `scene` after a restart, and sets known_applied_ to the number of its last applied
  // batch.
  void check(const std::map<uint64_t, PlacedPoint>& scene) {
    std::map<uint64_t, PlacedPoint> own;
    for (const auto& [id, point] : scene)
      if (id >> 32 == number_) own[id] = point;
    const auto counter = own.find(id_of(number_, 0));
    const uint64_t last = counter == own.end() ? 0 : static_cast<uint64_t>(counter->second.x);
    EXPECT_GE(last, acknowledged_) << "writer " << number_ << ": acknowledged batches are lost";
    EXPECT_LE(last, max_sent_);
    EXPECT_TRUE(own == model(last)) << "writer " << number_ << ": the scene is not what batches up to " << last
                                    << " make";
    known_applied_ = last;
  }

 private:
  void take(const v1::StreamUpdatesResponse& response) {
    ASSERT_EQ(response.sequence(), acknowledged_ + 1) << "out of order";
    ASSERT_FALSE(response.has_error()) << response.ShortDebugString();
    if (response.ack().pending()) return;
    EXPECT_EQ(response.ack().refused(), 0u) << "batch " << response.sequence() << " was applied before";
    // If a batch was applied before the kill but not acknowledged, the daemon acknowledges it as a duplicate.
    EXPECT_EQ(response.ack().duplicate(), response.sequence() <= known_applied_);
    ++acknowledged_;
  }

  const uint64_t number_;
  uint64_t acknowledged_ = 0;
  uint64_t max_sent_ = 0;
  uint64_t known_applied_ = 0;
};

class KillTest : public ::testing::Test {
 protected:
  static constexpr uint64_t kWriters = 3;

  void SetUp() override {
    daemon_.start();
    for (int i = 0; i < kScenes; ++i) epochs_.push_back(create_scene(daemon_.stubs(), scene_name(i)).epoch());
    for (uint64_t number = 1; number <= kWriters; ++number) writers_.emplace_back(number);
  }

  // Starts all writers and kills the daemon after a random time of up to `max_ms`.
  void kill_under_load(int max_ms) {
    std::vector<std::thread> threads;
    for (Writer& writer : writers_)
      threads.emplace_back([&] { writer.write(daemon_.stubs(), std::numeric_limits<uint64_t>::max()); });
    std::this_thread::sleep_for(std::chrono::microseconds(std::uniform_int_distribution(0, 1000 * max_ms)(random_)));
    daemon_.kill();
    for (std::thread& thread : threads) thread.join();
  }

  void expect_nothing_lost() {
    for (int i = 0; i < kScenes; ++i)
      EXPECT_EQ(get_scene(daemon_.stubs(), scene_name(i)).epoch(), epochs_[i]) << "another epoch, but nothing is lost";
    for (int i = 0; i < kScenes; ++i) {
      const std::map<uint64_t, PlacedPoint> scene = points_of(daemon_.stubs(), scene_name(i));
      for (uint64_t number = 1; number <= kWriters; ++number)
        if (scene_name(number) == scene_name(i)) writers_[number - 1].check(scene);
    }
  }

  void run(int kills) {
    for (int kill = 0; kill < kills && !HasFailure(); ++kill) {
      SCOPED_TRACE("kill " + std::to_string(kill));
      kill_under_load(300);
      daemon_.start();
      expect_nothing_lost();
    }
    for (Writer& writer : writers_) {
      const uint64_t before = writer.acknowledged();
      writer.write(daemon_.stubs(), before + 100);
      EXPECT_EQ(writer.acknowledged(), before + 100);
      EXPECT_GT(before, 0u);
    }
    EXPECT_EQ(daemon_.stop(), 0) << daemon_.log();
  }

  // The small limit makes it likely that a snapshot is being written when the daemon is killed.
  KeptDaemon daemon_{{"--snapshot-after", "64KiB"}};
  std::vector<uint64_t> epochs_;
  std::vector<Writer> writers_;
  std::mt19937 random_{20261122};
};

TEST_F(KillTest, NoAcknowledgedBatchIsLostRepeatedOrReordered) { run(static_cast<int>(scaled_count(10))); }

using LongKillTest = KillTest;

TEST_F(LongKillTest, NoAcknowledgedBatchIsLostRepeatedOrReordered) {
  const char* runs = std::getenv("LOCUS_FAULT_RUNS");
  run(runs == nullptr ? 100 : std::atoi(runs));
}

}  // namespace
}  // namespace locus::test
