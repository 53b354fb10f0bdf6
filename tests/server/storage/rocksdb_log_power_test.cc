// Power losses at random moments, simulated by a file system that drops unsynced data. The Long suite simulates a
// thousand power losses, or LOCUS_FAULT_RUNS if that is set.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <memory>

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

enum class Syncing : uint8_t { kAsPromised, kNever };

struct Outcome {
  std::string difference;
  uint64_t acknowledged = 0;
};

// Writes to a log until the power fails; for some seeds, the process is first killed and restarted. Returns the
// difference between the acknowledged contents and the contents found afterwards.
Outcome lose_power_once(uint64_t seed, Syncing syncing) {
  Random random(seed);
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.file("disk"));
  auto files = std::make_shared<FaultyFiles>(folder.file("disk"), folder.file("graves"));
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(files);
  StorageOptions options;
  options.path = folder.file("disk/data");
  options.env = env.get();
  options.reserve_bytes = 0;
  options.log_buffer_bytes = 0;  // RocksDB uses its minimum instead, and so often writes tables
  options.durable_marker_delay = std::chrono::milliseconds(1);
  options.memory_sync_delay = std::chrono::milliseconds(2);
  options.sync = syncing == Syncing::kAsPromised;
  StoredModel model;
  const uint64_t lives = 1 + random.below(3);
  for (uint64_t life = 0; life < lives; ++life) {
    files->go_on();
    auto log = RocksdbLog::open(options);
    if (!log.ok()) return {"a killed process leaves what does not open: " + log.status().ToString()};
    if (std::string difference = model.difference(**log, test::Refusals::kNone); !difference.empty())
      return {"after a kill: " + difference};
    files->stop_before(random.below(400));
    while (!files->stopped()) model.step(**log, random);
  }
  files->lose_power(folder.file("after"), random, random.chance(0.5));
  const auto later = std::make_shared<FaultyFiles>(folder.file("after"), folder.file("later graves"));
  const std::unique_ptr<rocksdb::Env> later_env = rocksdb::NewCompositeEnv(later);
  options.path = folder.file("after/data");
  options.env = later_env.get();
  const auto log = RocksdbLog::open(options);
  if (!log.ok()) return {log.status().ToString(), model.acknowledged()};
  return {model.difference(**log, test::Refusals::kNone), model.acknowledged()};
}

void expect_nothing_lost(uint64_t first_seed, uint64_t runs) {
  uint64_t acknowledged = 0;
  for (uint64_t seed = first_seed; seed < first_seed + runs; ++seed) {
    const Outcome outcome = lose_power_once(seed, Syncing::kAsPromised);
    EXPECT_EQ(outcome.difference, "") << "seed " << seed;
    acknowledged += outcome.acknowledged;
  }
  EXPECT_GT(acknowledged, 0u);
  std::cout << "proof: " << runs << " power losses, " << acknowledged << " acknowledged records, seeds from "
            << first_seed << std::endl;
}

TEST(RocksdbLogPowerTest, PowerLossLosesNoAcknowledgedRecord) { expect_nothing_lost(1, test::scaled_count(20)); }

TEST(LongRocksdbLogPowerTest, PowerLossLosesNoAcknowledgedRecord) {
  const char* runs = std::getenv("LOCUS_FAULT_RUNS");
  expect_nothing_lost(1000, runs == nullptr ? 1000 : std::strtoull(runs, nullptr, 10));
}

TEST(RocksdbLogPowerTest, LossWithoutSyncsIsDetected) {
  uint64_t seen = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) seen += !lose_power_once(seed, Syncing::kNever).difference.empty();
  EXPECT_GT(seen, 0u);
}

}  // namespace
}  // namespace locus::server
