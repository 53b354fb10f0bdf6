#include "client/cli/backup/read_backup.h"

#include "tests/client/cli/backup/backup_fixture.h"

namespace locus::cli {
namespace {

using testing::files_of;
using ::testing::HasSubstr;
using testing::Outcome;
using ::testing::StartsWith;

// Fixture with a backup of the planned files. No server is used.
class RestoreCommandTest : public testing::BackupFixture {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"backup", backup_}).code, ExitCode::kOk);
    server_.stop();
  }

  void write(const std::string& path, const std::string& bytes) {
    std::ofstream(backup_ + "/" + path, std::ios::binary | std::ios::trunc) << bytes;
  }

  // Expects that both --verify-only and a restore refuse the backup with a message that contains `how`.
  void expect_damaged(const std::string& how) {
    for (const std::vector<std::string>& line :
         std::vector<std::vector<std::string>>{{"restore", backup_, "--verify-only"}, {"restore", backup_, data_}}) {
      const Outcome outcome = run(line);
      EXPECT_EQ(outcome.code, ExitCode::kFailed);
      EXPECT_THAT(outcome.err, HasSubstr("the backup " + backup_ + " is damaged: "));
      EXPECT_THAT(outcome.err, HasSubstr(how));
    }
    EXPECT_FALSE(std::filesystem::exists(data_));
    EXPECT_FALSE(std::filesystem::exists(data_ + ".partial"));
  }

  const std::string data_ = folder_.file("data");
};

TEST_F(RestoreCommandTest, TheDataDirectoryHasExactlyTheFilesOfTheServer) {
  const Json report = json_of({"restore", backup_, data_});
  EXPECT_EQ(report.dump(), Json({{"data_dir", data_}, {"files", 3}, {"bytes", 14}}).dump());
  EXPECT_EQ(files_of(data_), planned_);
}

TEST_F(RestoreCommandTest, TheNextCommandsAreSuggested) {
  const Outcome outcome = run({"restore", backup_ + "/", data_ + "/"});
  EXPECT_EQ(outcome.code, ExitCode::kOk);
  EXPECT_THAT(outcome.err, StartsWith("next: `locusd check " + data_ + "`, then `locusd --data-dir " + data_ + "`"));
}

TEST_F(RestoreCommandTest, VerifyOnlyAcceptsAnIntactBackupAndWritesNothing) {
  EXPECT_EQ(json_of({"restore", "--verify-only", backup_})["whole"], true);
  EXPECT_FALSE(std::filesystem::exists(data_));
}

TEST_F(RestoreCommandTest, EveryFlippedByteOfEveryFileIsFound) {
  for (const auto& [path, bytes] : files_of(backup_)) {
    for (size_t i = 0; i < bytes.size(); ++i) {
      for (const int flip : {0x01, 0x20, 0x80}) {
        std::string damaged = bytes;
        damaged[i] = static_cast<char>(damaged[i] ^ flip);
        write(path, damaged);
        ASSERT_EQ(run({"restore", backup_, data_}).code, ExitCode::kFailed) << path << " byte " << i << " ^ " << flip;
        ASSERT_FALSE(std::filesystem::exists(data_));
      }
    }
    write(path, bytes);
  }
  EXPECT_EQ(run({"restore", backup_, data_}).code, ExitCode::kOk) << "all is as it was";
}

TEST_F(RestoreCommandTest, EveryTruncationOfEveryFileIsFound) {
  for (const auto& [path, bytes] : files_of(backup_)) {
    for (size_t length = 0; length < bytes.size(); ++length) {
      write(path, bytes.substr(0, length));
      ASSERT_EQ(run({"restore", backup_, data_}).code, ExitCode::kFailed) << path << " cut to " << length;
    }
    write(path, bytes);
  }
}

TEST_F(RestoreCommandTest, ADamagedFileIsReported) {
  write("tables/000007.sst", "other");
  expect_damaged("tables/000007.sst does not match its checksum in SHA256SUMS");
}

TEST_F(RestoreCommandTest, AMissingFileIsReported) {
  std::filesystem::remove(backup_ + "/CURRENT");
  expect_damaged("CURRENT is missing");
}

TEST_F(RestoreCommandTest, AnUnlistedFileIsReported) {
  write("tables/more", "");
  expect_damaged("tables/more is not listed in SHA256SUMS");
}

TEST_F(RestoreCommandTest, ASymbolicLinkIsReported) {
  std::filesystem::rename(backup_ + "/CURRENT", folder_.file("elsewhere"));
  std::filesystem::create_symlink(folder_.file("elsewhere"), backup_ + "/CURRENT");
  expect_damaged("CURRENT is no regular file");
}

TEST_F(RestoreCommandTest, VerifyingNamesTheFirstFewAndCountsTheRest) {
  for (int i = 0; i < 9; ++i) write("extra" + std::to_string(i), "");
  const Outcome outcome = run({"restore", backup_, "--verify-only"});
  EXPECT_THAT(outcome.err, HasSubstr("extra4 is not listed in SHA256SUMS and 4 more; take another backup"));
}

TEST_F(RestoreCommandTest, ANonEmptyDataDirectoryIsRefusedAndUnchanged) {
  std::filesystem::create_directory(data_);
  std::ofstream(data_ + "/CURRENT") << "precious";
  const Outcome outcome = run({"restore", backup_, data_});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("nothing is overwritten"));
  EXPECT_EQ(files_of(data_), (testing::Files{{"CURRENT", "precious"}}));
}

TEST_F(RestoreCommandTest, AnEmptyDataDirectoryIsFilled) {
  std::filesystem::create_directory(data_);
  EXPECT_EQ(run({"restore", backup_, data_}).code, ExitCode::kOk);
  EXPECT_EQ(files_of(data_), planned_);
}

TEST_F(RestoreCommandTest, ADirectoryWithoutChecksumsIsNotFound) {
  for (const std::string& path : {folder_.file("nowhere"), folder_.path()}) {
    const Outcome outcome = run({"restore", path, data_});
    EXPECT_EQ(outcome.code, ExitCode::kNotFound) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("it has no SHA256SUMS"));
  }
}

TEST_F(RestoreCommandTest, EitherATargetOrVerifyOnlyIsRequired) {
  EXPECT_EQ(run({"restore", backup_}).code, ExitCode::kUsage);
  EXPECT_EQ(run({"restore", backup_, data_, "--verify-only"}).code, ExitCode::kUsage);
  EXPECT_EQ(run({"restore"}).code, ExitCode::kUsage);
}

}  // namespace
}  // namespace locus::cli
