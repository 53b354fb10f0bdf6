// A disk that fails for a while: failing syncs and writes, and a full disk. The log keeps every acknowledged record,
// and accepts writes again without a restart.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/base/mutex.h"
#include "core/base/refusal.h"
#include "server/storage/rocksdb_log.h"
#include "tests/support/faulty_files.h"
#include "tests/support/small_disk.h"
#include "tests/support/stored_log.h"

namespace locus::server {
namespace {

using test::append_records;
using test::create_scene;
using test::FaultyFiles;
using test::record_difference;
using test::SmallDisk;
using test::write_snapshot;

// Calls `once` until it succeeds, for up to about a minute, so that slow machines pass. Returns the last status.
template <class Try>
absl::Status succeeds_soon(const Try& once) {
  absl::Status status;
  for (int i = 0; i < 6000; ++i) {
    status = once();
    if (status.ok()) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return status;
}

class RocksdbLogFaultTest : public ::testing::Test {
 protected:
  RocksdbLogFaultTest() {
    std::filesystem::create_directories(folder_.file("disk"));
    files_ = std::make_shared<FaultyFiles>(folder_.file("disk"), folder_.file("graves"));
    env_ = rocksdb::NewCompositeEnv(files_);
    options_.path = folder_.file("disk/data");
    options_.env = env_.get();
    options_.reserve_bytes = 0;
    open();
  }

  void open() {
    log_ = nullptr;
    auto log = RocksdbLog::open(options_);
    ASSERT_TRUE(log.ok()) << log.status();
    log_ = *std::move(log);
  }
  void expect_records(SceneKey scene, uint64_t last) {
    uint64_t found = 0;
    EXPECT_EQ(record_difference(*log_, scene, 1, found), "");
    EXPECT_EQ(found, last);
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<FaultyFiles> files_;
  std::unique_ptr<rocksdb::Env> env_;
  StorageOptions options_;
  std::unique_ptr<RocksdbLog> log_;
};

TEST_F(RocksdbLogFaultTest, FailedSyncAcknowledgesNothingAndWritingResumes) {
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  ASSERT_EQ(append_records(*log_, scene, 7, 5), absl::OkStatus());
  files_->fail_syncs(1);
  EXPECT_EQ(append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(log_->latest(scene).value(), 5u);
  EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1); }), absl::OkStatus());
  expect_records(scene, 6);
  open();
  EXPECT_EQ(test::find_stored(*log_, "a")->damage, absl::OkStatus());
  expect_records(scene, 6);
}

// Right after opening, the memory tables are empty. While they are empty, RocksDB's Resume() alone would continue to
// write to the log file that failed.
TEST_F(RocksdbLogFaultTest, WritingResumesAfterAWriteThatFailsRightAfterOpening) {
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  for (int times = 0; times < 3; ++times) {
    files_->fail_writes(1);
    EXPECT_EQ(append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kUnavailable);
    EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1); }), absl::OkStatus());
    open();
  }
  expect_records(scene, 3);
}

// The write that fills a memory table schedules a flush. If this write fails before the thread of flushes has started
// the flush, RocksDB's flush returns at once but stays queued, and Resume() waits for it for ever.
TEST_F(RocksdbLogFaultTest, WritingResumesAfterAWriteThatFailsBeforeItsFlushStarts) {
  options_.path = folder_.file("disk/small");
  options_.log_buffer_bytes = uint64_t{64} << 10;
  open();
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  const std::string bytes(size_t{1} << 10, 'x');
  const auto append = [&](uint64_t sequence) {
    const LogEntry entry = test::entry_of(7, sequence, bytes);
    return log_->append(scene, {&entry, 1}, AckLevel::kMemory).status();
  };
  uint64_t kept = 0;
  for (int until_failure = 30; until_failure < 70; ++until_failure) {
    std::binary_semaphore flushes(0);  // RocksDB has one thread for flushes: this job keeps it busy
    rocksdb::Env::Default()->Schedule([](void* held) { static_cast<std::binary_semaphore*>(held)->acquire(); },
                                      &flushes, rocksdb::Env::Priority::HIGH);
    for (int i = 0; i < until_failure; ++i) {
      ASSERT_EQ(append(kept + 1), absl::OkStatus());
      ++kept;
    }
    files_->fail_writes(1);
    std::thread releases([&] {
      while (files_->writes_to_fail() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      flushes.release();
    });
    // The write that fails is this one, or one by which the log syncs earlier records. In the latter case, this one may
    // come after the log has resumed.
    if (append(kept + 1).ok()) ++kept;
    releases.join();
    EXPECT_EQ(files_->writes_to_fail(), 0);
    ASSERT_EQ(succeeds_soon([&] { return append(kept + 1); }), absl::OkStatus());
    ++kept;
  }
  EXPECT_EQ(log_->latest(scene).value(), kept);
}

// RocksDB aborts the process if its own text log is on a full disk, so RocksDB must not write a text log.
TEST_F(RocksdbLogFaultTest, RocksDbsWarningsAreReportedAndNotWrittenToAFile) {
  Mutex mutex;
  std::string warnings;
  options_.path = folder_.file("disk/warned");
  options_.warn = [&](absl::string_view text) {
    MutexLock lock(mutex);
    absl::StrAppend(&warnings, text, "\n");
  };
  open();
  EXPECT_EQ(warnings, "") << "a new directory is no reason for a warning";
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  files_->fail_writes(1);
  EXPECT_EQ(append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1); }), absl::OkStatus());
  log_ = nullptr;
  EXPECT_THAT(warnings, testing::HasSubstr("a write failed"));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(options_.path))
    EXPECT_THAT(entry.path().filename().string(), testing::Not(testing::StartsWith("LOG"))) << entry.path();
}

TEST_F(RocksdbLogFaultTest, RefusedRecordsDoNotReappearAfterLaterOnes) {
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  ASSERT_EQ(append_records(*log_, scene, 7, 2), absl::OkStatus());
  const std::string bytes = "refused";
  const std::vector<LogEntry> refused(3, test::entry_of(7, 99, bytes));
  files_->fail_syncs(1);
  EXPECT_FALSE(log_->append(scene, refused, AckLevel::kLocal).ok());
  EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1); }), absl::OkStatus());
  // The process is killed and the power fails: only synced data remains.
  test::Random random(1);
  files_->stop_before(0);
  log_ = nullptr;
  files_->lose_power(folder_.file("after"), random, false);
  options_.path = folder_.file("after/data");
  options_.env = nullptr;
  open();
  expect_records(scene, 3);
}

TEST_F(RocksdbLogFaultTest, FailedSyncsOfManyAppendersLoseNoAcknowledgedRecord) {
  constexpr SceneKey kScenes = 6;
  for (SceneKey scene = 1; scene <= kScenes; ++scene)
    ASSERT_EQ(create_scene(*log_, absl::StrCat("s", scene), scene).value(), scene);
  std::vector<std::thread> threads;
  std::vector<uint64_t> acknowledged(kScenes + 1);
  for (SceneKey scene = 1; scene <= kScenes; ++scene) {
    threads.emplace_back([&, scene] {
      for (int i = 0; i < 60; ++i) {
        if (append_records(*log_, scene, 7, 1).ok()) {
          acknowledged[scene] = log_->latest(scene).value();
        } else {
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
      }
    });
  }
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    files_->fail_syncs(1);
  }
  for (std::thread& thread : threads) thread.join();
  files_->fail_syncs(0);
  test::Random random(2);
  files_->stop_before(0);
  log_ = nullptr;
  files_->lose_power(folder_.file("after"), random, true);
  options_.path = folder_.file("after/data");
  options_.env = nullptr;
  open();
  for (const StoredScene& stored : log_->stored_scenes()) {
    EXPECT_EQ(stored.damage, absl::OkStatus());
    EXPECT_GE(stored.last_sequence, acknowledged[stored.key]);
    uint64_t found = 0;
    EXPECT_EQ(record_difference(*log_, stored.key, 1, found), "");
  }
  EXPECT_EQ(log_->stored_scenes().size(), kScenes);
}

TEST_F(RocksdbLogFaultTest, FullDiskIsRefusedByLimitAndWritingResumes) {
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  ASSERT_EQ(append_records(*log_, scene, 7, 5), absl::OkStatus());
  files_->fill(true);
  absl::Status status;
  while (status.ok()) status = append_records(*log_, scene, 7, 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(refusal_of(status).has_value());
  EXPECT_EQ(refusal_of(status)->limit, "disk_bytes");
  EXPECT_GT(refusal_of(status)->retry_after_ms, 0u);
  const uint64_t last = log_->latest(scene).value();
  expect_records(scene, last);
  EXPECT_FALSE(write_snapshot(*log_, scene, last).ok());
  files_->fill(false);
  EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1); }), absl::OkStatus());
  EXPECT_EQ(succeeds_soon([&] { return write_snapshot(*log_, scene, 3); }), absl::OkStatus());
  open();
  EXPECT_EQ(test::find_stored(*log_, "a")->last_sequence, last + 1);
  EXPECT_EQ(test::find_stored(*log_, "a")->snapshot_sequence, 3u);
}

TEST_F(RocksdbLogFaultTest, SmallDiskFillsUpToItsReserveAndWritingResumes) {
  const SmallDisk disk(folder_.file("small"), 48);
  if (!disk.mounted()) GTEST_SKIP() << "mounting a tmpfs takes root";
  options_ = StorageOptions();
  options_.path = folder_.file("small/data");
  open();
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  const std::string ballast = folder_.file("small/ballast");
  test::write_file_bytes(ballast, std::string(size_t{20} << 20, 'x'));
  absl::Status status;
  while (status.ok()) status = append_records(*log_, scene, 7, 1, AckLevel::kLocal, 300'000);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  const uint64_t last = log_->latest(scene).value();
  uint64_t found = 0;
  EXPECT_EQ(record_difference(*log_, scene, 1, found, 300'000), "");
  EXPECT_EQ(found, last);
  std::filesystem::remove(ballast);
  EXPECT_EQ(succeeds_soon([&] { return append_records(*log_, scene, 7, 1, AckLevel::kLocal, 300'000); }),
            absl::OkStatus());
  open();
  EXPECT_EQ(record_difference(*log_, scene, 1, found, 300'000), "");
  EXPECT_EQ(found, last + 1);
}

TEST_F(RocksdbLogFaultTest, DiskWithoutFreeBytesLosesNoRecord) {
  const SmallDisk disk(folder_.file("small"), 48);
  if (!disk.mounted()) GTEST_SKIP() << "mounting a tmpfs takes root";
  options_ = StorageOptions();
  options_.path = folder_.file("small/data");
  options_.reserve_bytes = 0;
  open();
  const SceneKey scene = create_scene(*log_, "a", 1).value();
  const std::string ballast = folder_.file("small/ballast");
  test::write_file_bytes(ballast, std::string(size_t{30} << 20, 'x'));
  const auto append = [&] { return append_records(*log_, scene, 7, 1, AckLevel::kLocal, 300'000); };
  for (int times = 0; times < 2; ++times) {
    absl::Status status;
    while (status.ok()) status = append();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    uint64_t found = 0;
    EXPECT_EQ(record_difference(*log_, scene, 1, found, 300'000), "");
    EXPECT_EQ(found, log_->latest(scene).value());
    // Frees as many bytes as each refusal requires. The number depends on how many memory tables are already flushed.
    const absl::Status resumed = succeeds_soon([&] {
      const absl::Status refused = append();
      const std::optional<Refusal> refusal = refusal_of(refused);
      const uintmax_t needed = refusal ? static_cast<uintmax_t>(refusal->asked) : 0;
      const uintmax_t available = std::filesystem::space(ballast).available;
      if (needed > available) {
        const uintmax_t size = std::filesystem::file_size(ballast);
        std::filesystem::resize_file(ballast, size - std::min(size, needed - available));
      }
      return refused;
    });
    EXPECT_EQ(resumed, absl::OkStatus());
    EXPECT_GT(std::filesystem::file_size(ballast), 0u);
  }
  const uint64_t last = log_->latest(scene).value();
  open();
  uint64_t found = 0;
  EXPECT_EQ(record_difference(*log_, scene, 1, found, 300'000), "");
  EXPECT_EQ(found, last);
}

TEST_F(RocksdbLogFaultTest, ReadOnlyDirectoryIsRefusedWithAReason) {
  SmallDisk disk(folder_.file("small"), 48);
  if (!disk.mounted()) GTEST_SKIP() << "mounting a tmpfs takes root";
  options_ = StorageOptions();
  options_.path = folder_.file("small/data");
  open();
  create_scene(*log_, "a", 1).value();
  log_ = nullptr;
  ASSERT_TRUE(disk.make_read_only());
  const auto log = RocksdbLog::open(options_);
  EXPECT_EQ(log.status().code(), absl::StatusCode::kUnavailable) << log.status();
  EXPECT_NE(log.status().message().find("Read-only"), std::string::npos) << log.status();
}

}  // namespace
}  // namespace locus::server
