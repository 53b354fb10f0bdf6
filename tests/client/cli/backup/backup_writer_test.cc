#include "client/cli/backup/backup_writer.h"

#include "tests/client/cli/backup/backup_fixture.h"

namespace locus::cli {
namespace {

using testing::files_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

using BackupCommandTest = testing::BackupFixture;

TEST_F(BackupCommandTest, TheBackupHasChecksumsThatCoreutilsVerifies) {
  const Json report = json_of({"backup", backup_});
  EXPECT_EQ(report.dump(), Json({{"directory", backup_}, {"files", 3}, {"bytes", 14}}).dump());
  testing::Files files = files_of(backup_);
  EXPECT_THAT(files["SHA256SUMS"], HasSubstr("  tables/000007.sst\n"));
  const std::string check = "cd " + backup_ + " && sha256sum --strict --quiet -c SHA256SUMS >/dev/null 2>&1";
  EXPECT_EQ(system(check.c_str()), 0);
  std::ofstream(backup_ + "/CURRENT") << "MANIFEST-2\n";
  EXPECT_NE(system(check.c_str()), 0);
  files.erase("SHA256SUMS");
  EXPECT_EQ(files, planned_);
}

TEST_F(BackupCommandTest, ProgressIsWrittenOnlyIfLive) {
  const Outcome outcome = run({"backup", backup_}, Progress::kLive);
  EXPECT_THAT(outcome.err, HasSubstr("backing up " + backup_));
  EXPECT_THAT(run({"backup", folder_.file("quiet")}).err, IsEmpty());
}

TEST_F(BackupCommandTest, AnInterruptedOrDamagedBackupLeavesNoFiles) {
  server_.servers.backup_end = {grpc::StatusCode::UNAVAILABLE, "planned"};
  EXPECT_EQ(run({"backup", backup_}).code, ExitCode::kUnreachable);
  server_.servers.backup_end = {};
  server_.servers.backup_pieces.pop_back();
  EXPECT_THAT(run({"backup", backup_}).err, HasSubstr("less came than was announced"));
  server_.servers.backup_pieces[1].set_data("MANIFEST-2\n");
  const Outcome damaged = run({"backup", backup_});
  EXPECT_EQ(damaged.code, ExitCode::kFailed);
  EXPECT_THAT(damaged.err, HasSubstr("error: the backup came damaged"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(BackupCommandTest, AnExistingDirectoryIsRefused) {
  std::filesystem::create_directory(backup_);
  const Outcome outcome = run({"backup", backup_});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("exists already: choose another directory"));
  EXPECT_TRUE(std::filesystem::is_empty(backup_));
}

TEST_F(BackupCommandTest, AServerWithoutStorageIsReportedWithItsOwnMessage) {
  v1::Error error;
  error.set_reason(v1::REASON_NOT_SERVED);
  server_.servers.backup_pieces.clear();
  server_.servers.backup_end =
      client::testing::refusal(grpc::StatusCode::UNIMPLEMENTED, "start it with --data-dir", error);
  const Outcome outcome = run({"backup", backup_});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("error: start it with --data-dir"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(BackupCommandTest, AFileNamedSha256SumsFromTheServerIsRefused) {
  server_.servers.plan_backup({{"SHA256SUMS", "mine"}});
  EXPECT_THAT(run({"backup", backup_}).err, HasSubstr("a name that the backup itself uses"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(BackupCommandTest, APathOutsideTheBackupIsRefused) {
  server_.servers.plan_backup({{"../escaped", "bytes"}});
  const Outcome outcome = run({"backup", backup_});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("leads out of its directory"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace locus::cli
