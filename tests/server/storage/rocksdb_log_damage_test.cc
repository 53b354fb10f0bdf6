// Damages a small data directory at one position at a time, and then opens it. A byte is flipped, or a file is
// truncated, zeroed or missing. Each scene must be either refused or identical to the scene that was written. Each
// directory (in the Long suite every eighth) is opened twice, and both openings must report the same damage.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "server/storage/rocksdb_log.h"
#include "tests/support/faulty_files.h"
#include "tests/support/stored_log.h"
#include "tests/support/stored_model.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::FaultyFiles;
using test::Random;
using test::StoredModel;

// Contents of files by their paths below the data directory.
using Files = std::map<std::string, std::string>;

// Way in which the last process that wrote the sample ended.
enum class Ending : uint8_t { kInOrder, kKilled };

struct Sample {
  Files files;
  StoredModel model;
};

// Result of opening a directory once.
struct Verdict {
  std::string opening;                        // error of RocksdbLog::open(); empty if it succeeded
  std::map<std::string, std::string> damage;  // damage by scene name; "" = the catalogue
  std::string difference;                     // first difference from the acknowledged contents; empty if there is none
  size_t served = 0;

  bool operator==(const Verdict&) const = default;
};

Files files_below(const std::string& folder) {
  Files files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[entry.path().string().substr(folder.size() + 1)] = test::file_bytes(entry.path().string());
  }
  return files;
}

void write_files(const Files& files, const std::string& folder) {
  for (const auto& [name, bytes] : files) {
    const std::string path = folder + "/" + name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    test::write_file_bytes(path, bytes);
  }
}

StorageOptions small_options(const std::string& path, rocksdb::Env* env) {
  StorageOptions options;
  options.path = path;
  options.env = env;
  options.reserve_bytes = 0;
  options.log_buffer_bytes = 1 << 16;  // small, because RocksDB reserves this size for its log at each opening
  options.durable_marker_delay = std::chrono::milliseconds(1);
  options.memory_sync_delay = std::chrono::milliseconds(1);
  return options;
}

// Returns whether the log accepts a write.
bool write_mesh(UpdateLog& log) {
  const test::ChunksFrom content({"content"});
  return log.add_mesh("probe", test::hash_of(99), content, test::ChunksFrom({"parts"})).ok() &&
         log.delete_mesh("probe").ok();
}

// Makes a directory with a few scenes and meshes. Snapshots and records of the scenes are partly in tables and partly
// in RocksDB's log.
Sample make_sample(Ending ending, int max_steps) {
  Sample sample;
  const test::TemporaryFolder folder;
  const auto faulty = std::make_shared<FaultyFiles>(folder.path(), folder.file("graves"));
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(faulty);
  const StorageOptions options = small_options(folder.file("data"), env.get());
  Random random(3);
  for (int life = 0; life < 3; ++life) {
    auto log = RocksdbLog::open(options);
    LOCUS_CHECK(log.ok());
    const int steps = life == 2 ? max_steps / 2 : max_steps;
    const int failing = max_steps * 2 / 3;
    for (int step = 0; step < steps; ++step) {
      // Makes a sync fail: RocksDB then writes tables while it recovers from the error, so the sample contains tables.
      if (life < 2 && step == failing) faulty->fail_syncs(1);
      sample.model.step(**log, random);
      while (life < 2 && step == failing && !write_mesh(**log))
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (life < 2 || ending == Ending::kInOrder) continue;
    // After this pause the durable marker is up to date. The files are copied while the log is open, because a killed
    // process leaves the files of an open log.
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    sample.files = files_below(options.path);
  }
  if (ending == Ending::kInOrder) sample.files = files_below(options.path);
  return sample;
}

Verdict open_once(const std::string& path, rocksdb::Env* env, const StoredModel& model) {
  Verdict verdict;
  const auto log = RocksdbLog::open(small_options(path, env));
  if (!log.ok()) {
    verdict.opening = log.status().ToString();
    if (!absl::IsDataLoss(log.status())) verdict.difference = "refused as if it were no damage: " + verdict.opening;
    return verdict;
  }
  for (const StoredScene& scene : (*log)->stored_scenes()) {
    if (scene.damage.ok()) {
      ++verdict.served;
    } else {
      verdict.damage[scene.name] = std::string(scene.damage.message());
    }
  }
  if (!(*log)->catalogue_damage().ok()) verdict.damage[""] = std::string((*log)->catalogue_damage().message());
  verdict.difference = model.difference(**log, test::Refusals::kAllowed);
  return verdict;
}

// Writes `files` to a directory and opens it `times` times; returns the result of each opening.
std::vector<Verdict> open_damaged_files(const Files& files, const StoredModel& model, int times) {
  const test::TemporaryFolder folder;
  write_files(files, folder.file("data"));
  const auto faulty = std::make_shared<FaultyFiles>(folder.path(), folder.file("graves"));
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(faulty);
  std::vector<Verdict> verdicts;
  for (int time = 0; time < times; ++time) verdicts.push_back(open_once(folder.file("data"), env.get(), model));
  return verdicts;
}

enum class Trials : uint8_t { kFew, kEvery };

uint64_t stride(Trials trials, uint64_t positions, uint64_t few) {
  return trials == Trials::kEvery ? 1 : std::max<uint64_t>(1, positions / test::scaled_count(few));
}

bool holds_data(const std::string& name) {
  return !absl::StartsWith(name, "rocksdb/LOG") && !absl::StartsWith(name, "rocksdb/OPTIONS");
}

class RocksdbLogDamageTest : public ::testing::TestWithParam<Ending> {
 protected:
  virtual const Sample& sample() const {
    static const Sample in_order = make_sample(Ending::kInOrder, 60);
    static const Sample killed = make_sample(Ending::kKilled, 60);
    return GetParam() == Ending::kInOrder ? in_order : killed;
  }
  // Returns n: every n-th directory is opened twice.
  virtual uint64_t opened_again() const { return 1; }

  void expect_no_silent_loss(const Files& files, const std::string& what) {
    const bool again = tried_++ % opened_again() == 0;
    const std::vector<Verdict> verdicts = open_damaged_files(files, sample().model, again ? 2 : 1);
    EXPECT_EQ(verdicts.front().difference, "") << what;
    EXPECT_EQ(verdicts.back().difference, "") << what << ", opened again";
    EXPECT_EQ(verdicts.front().opening, verdicts.back().opening) << what;
    EXPECT_EQ(verdicts.front().damage, verdicts.back().damage) << what;
    noticed_ += !verdicts[0].opening.empty() || !verdicts[0].damage.empty();
    served_beside_ += !verdicts[0].damage.empty() && verdicts[0].served > 0;
  }

  void flip_bytes(Trials trials) {
    for (const auto& [name, bytes] : sample().files) {
      if (!holds_data(name)) continue;
      const uint64_t step = stride(trials, bytes.size(), 8);
      for (uint64_t at = 0; at < bytes.size(); at += step) {
        const uint64_t position = step == 1 ? at : at + Random(at).below(std::min(step, bytes.size() - at));
        Files files = sample().files;
        files[name][position] = static_cast<char>(files[name][position] ^ (1 << position % 8));
        expect_no_silent_loss(files, absl::StrCat(name, " flipped at ", position, " of ", bytes.size()));
      }
    }
    EXPECT_GT(noticed_, 5u);
    EXPECT_GT(served_beside_, 0u);
  }

  // Flips bytes in the last blocks of tables. RocksDB reads these blocks before it verifies any checksum.
  void flip_ends_of_tables() {
    constexpr size_t kFromEnd = 130, kToEnd = 100;
    for (const auto& [name, bytes] : sample().files) {
      if (!absl::EndsWith(name, ".sst")) continue;
      for (size_t position = bytes.size() - kFromEnd; position < bytes.size() - kToEnd; position += test::kSlowdown) {
        Files files = sample().files;
        files[name][position] = static_cast<char>(files[name][position] ^ 0x80);
        expect_no_silent_loss(files, absl::StrCat(name, " flipped at ", position, " of ", bytes.size()));
      }
    }
    EXPECT_GT(noticed_, 5u);
  }

  void cut_files(Trials trials) {
    for (const auto& [name, bytes] : sample().files) {
      if (!holds_data(name)) continue;
      const uint64_t step = stride(trials, bytes.size(), 4);
      for (uint64_t at = 0; at < bytes.size(); at += step) {
        Files files = sample().files;
        files[name].resize(at);
        expect_no_silent_loss(files, absl::StrCat(name, " cut to ", at, " of ", bytes.size()));
      }
    }
    EXPECT_GT(noticed_, 5u);
  }

  void zero_pages(Trials trials) {
    constexpr size_t kPage = 512;
    for (const auto& [name, bytes] : sample().files) {
      if (!holds_data(name)) continue;
      const uint64_t pages = (bytes.size() + kPage - 1) / kPage;
      const uint64_t step = stride(trials, pages, 3);
      for (uint64_t page = 0; page < pages; page += step) {
        Files files = sample().files;
        std::string& cut = files[name];
        std::fill(cut.begin() + page * kPage, cut.begin() + std::min(cut.size(), (page + 1) * kPage), '\0');
        expect_no_silent_loss(files, absl::StrCat(name, " zeroed from ", page * kPage));
      }
    }
    EXPECT_GT(noticed_, 3u);
  }

  void report() const {
    std::cout << "proof: " << tried_ << " damaged directories, " << noticed_ << " noticed, in " << served_beside_
              << " other scenes served" << std::endl;
  }

  uint64_t tried_ = 0;
  uint64_t noticed_ = 0;
  uint64_t served_beside_ = 0;
};

// Fixture with a sample so small that a test can damage every byte.
class LongRocksdbLogDamageTest : public RocksdbLogDamageTest {
 protected:
  const Sample& sample() const override {
    static const Sample in_order = make_sample(Ending::kInOrder, 15);
    static const Sample killed = make_sample(Ending::kKilled, 15);
    return GetParam() == Ending::kInOrder ? in_order : killed;
  }
  uint64_t opened_again() const override { return 8; }
  void TearDown() override { report(); }
};

TEST_P(RocksdbLogDamageTest, SampleIsIntact) {
  const std::vector<Verdict> verdicts = open_damaged_files(sample().files, sample().model, 2);
  for (const Verdict& verdict : verdicts) {
    EXPECT_EQ(verdict.opening, "");
    EXPECT_TRUE(verdict.damage.empty());
    EXPECT_EQ(verdict.difference, "");
    EXPECT_GT(verdict.served, 2u);
  }
  int tables = 0, topologies = 0;
  for (const auto& [name, bytes] : sample().files) {
    tables += absl::EndsWith(name, ".sst");
    topologies += absl::StartsWith(name, "outlines/");
  }
  EXPECT_GT(tables, 3);
  EXPECT_GT(topologies, 0);
}

TEST_P(RocksdbLogDamageTest, FlippedByteLosesNothingSilently) { flip_bytes(Trials::kFew); }

TEST_P(RocksdbLogDamageTest, FlippedEndOfATableLosesNothingSilently) { flip_ends_of_tables(); }

TEST_P(RocksdbLogDamageTest, CutFileLosesNothingSilently) { cut_files(Trials::kFew); }

TEST_P(RocksdbLogDamageTest, MissingFileLosesNothingSilently) {
  for (const auto& [name, bytes] : sample().files) {
    Files files = sample().files;
    files.erase(name);
    expect_no_silent_loss(files, name + " removed");
  }
  EXPECT_GT(noticed_, 3u);
}

TEST_P(RocksdbLogDamageTest, ZeroedPageLosesNothingSilently) { zero_pages(Trials::kFew); }

TEST_P(LongRocksdbLogDamageTest, EveryFlippedByteLosesNothingSilently) { flip_bytes(Trials::kEvery); }

TEST_P(LongRocksdbLogDamageTest, EveryLengthLosesNothingSilently) { cut_files(Trials::kEvery); }

TEST_P(LongRocksdbLogDamageTest, EveryZeroedPageLosesNothingSilently) { zero_pages(Trials::kEvery); }

std::string name_of(const testing::TestParamInfo<Ending>& ending) {
  return ending.param == Ending::kInOrder ? "InOrder" : "Killed";
}
INSTANTIATE_TEST_SUITE_P(Endings, RocksdbLogDamageTest, ::testing::Values(Ending::kInOrder, Ending::kKilled), name_of);
INSTANTIATE_TEST_SUITE_P(Endings, LongRocksdbLogDamageTest, ::testing::Values(Ending::kInOrder, Ending::kKilled),
                         name_of);

}  // namespace
}  // namespace locus::server
