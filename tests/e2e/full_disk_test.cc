// A daemon whose disk is full answers queries, acknowledges no update that it cannot store, and accepts updates again
// as soon as there is space. A daemon whose directory cannot be written does not start.
#include <chrono>
#include <fstream>
#include <iostream>
#include <thread>

#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"
#include "tests/support/small_disk.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

constexpr uint64_t kPoints = 5000;
constexpr uint64_t kWriter = 3;

class FullDiskTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!disk_.mounted()) GTEST_SKIP() << "mounting a tmpfs takes root";
  }

  // Returns a batch that puts all points at x = `number`.
  static v1::UpdateBatch batch(uint64_t number) {
    v1::UpdateBatch batch;
    batch.set_writer(kWriter);
    batch.set_batch(number);
    google::protobuf::RepeatedField<uint64_t>* ids = nullptr;
    google::protobuf::RepeatedField<double>* positions = nullptr;
    if (number == 1) {
      v1::Insert* const insert = batch.add_inserts();
      insert->mutable_point();
      ids = insert->mutable_ids();
      positions = insert->mutable_positions_f64();
    } else {
      v1::Move* const move = batch.add_moves();
      ids = move->mutable_ids();
      positions = move->mutable_positions_f64();
    }
    for (uint64_t id = 1; id <= kPoints; ++id) {
      ids->Add(id);
      for (const double x : {static_cast<double>(number), static_cast<double>(id), 0.0}) positions->Add(x);
    }
    return batch;
  }

  grpc::Status apply(uint64_t number) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::ApplyUpdatesRequest request;
    request.set_scene("arena");
    *request.mutable_batch() = batch(number);
    v1::ApplyUpdatesResponse response;
    const grpc::Status status = daemon_.stubs().updates->ApplyUpdates(&context, request, &response);
    EXPECT_FALSE(response.ack().duplicate());
    return status;
  }

  // Expects queries to find all points at x = `number`.
  void expect_points_at(uint64_t number) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::QueryRequest request;
    request.set_scene("arena");
    v1::Balls* const ball = request.mutable_batch()->add_blocks()->mutable_balls();
    fill(ball->mutable_centers(), {static_cast<float>(number), 7.f, 0.f});
    ball->add_radii(0.25f);
    v1::QueryResponse response;
    const grpc::Status status = daemon_.stubs().queries->Query(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_THAT(response.result().blocks(0).ids(), ::testing::ElementsAre(7u));
    const std::map<uint64_t, PlacedPoint> points = points_of(daemon_.stubs(), "arena");
    EXPECT_EQ(points.size(), kPoints);
    for (const auto& [id, point] : points) ASSERT_EQ(point.x, static_cast<double>(number)) << id;
  }

  KeptDaemon daemon_;
  SmallDisk disk_{daemon_.directory(), 48};
};

TEST_F(FullDiskTest, OnAFullDiskQueriesAreAnsweredNoUpdateIsAckedAndWritesResumeWithSpace) {
  daemon_.start();
  create_scene(daemon_.stubs(), "arena");
  const std::string ballast = daemon_.directory() + "/ballast";
  std::ofstream(ballast, std::ios::binary) << std::string(size_t{20} << 20, 'x');
  uint64_t acked = 0;
  grpc::Status status;
  while ((status = apply(acked + 1)).ok()) ++acked;
  EXPECT_GT(acked, 1u);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(error_of(status).limit(), "disk_bytes");
  EXPECT_GT(error_of(status).retry_after_ms(), 0u);
  // RocksDB may still delete old log files, so the ballast takes the space that becomes free, until three batches in a
  // row are refused.
  for (int refused = 0; refused < 3; ++refused) {
    std::ofstream(ballast, std::ios::binary | std::ios::app) << std::string(size_t{48} << 20, 'x');
    while ((status = apply(acked + 1)).ok()) {
      ++acked;
      refused = 0;
    }
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  expect_points_at(acked);
  EXPECT_EQ(get_scene(daemon_.stubs(), "arena").revision(), acked);

  std::filesystem::remove(ballast);
  const auto room = std::chrono::steady_clock::now();
  for (int i = 0; i < 6000 && !(status = apply(acked + 1)).ok(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(status.ok()) << status.error_message();
  std::cout << "proof: writes came back "
            << std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - room).count()
            << " ms after there was room" << std::endl;
  expect_points_at(acked + 1);
  daemon_.kill();
  daemon_.start();
  expect_points_at(acked + 1);
}

TEST_F(FullDiskTest, ADirectoryThatCannotBeWrittenKeepsTheDaemonFromStarting) {
  ASSERT_TRUE(disk_.make_read_only());
  EXPECT_NE(daemon_.exit_code_of_start(), 0);
  EXPECT_THAT(daemon_.log(), HasSubstr(daemon_.directory()));
  EXPECT_THAT(daemon_.log(), HasSubstr("ead-only"));
}

}  // namespace
}  // namespace locus::test
