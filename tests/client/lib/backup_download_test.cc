#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/client.h"
#include "client/lib/transfers.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Sink that stores verified files in memory. Its begin_file() fails for the path `refused`.
class KeptFiles final : public BackupSink {
 public:
  absl::Status begin(const BackupSize& announced) override {
    size = announced;
    return absl::OkStatus();
  }
  absl::Status begin_file(const std::string& path) override {
    begun.push_back(path);
    return path == refused ? absl::ResourceExhaustedError("no room here") : absl::OkStatus();
  }
  absl::Status add(absl::string_view bytes) override {
    came.append(bytes.data(), bytes.size());
    return absl::OkStatus();
  }
  absl::Status end_file(const BackupFile& file) override {
    EXPECT_EQ(file.bytes, came.size());
    files[file.path] = std::move(came);
    came.clear();
    return absl::OkStatus();
  }

  BackupSize size;
  std::vector<std::string> begun;
  std::string came;
  std::map<std::string, std::string> files;
  std::string refused;
};

// Fixture with a fake server that sends a backup of three files as an announcement and three messages.
class BackupDownloadTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
    server_.servers.plan_backup(planned_);
  }

  std::vector<v1::BackupResponse>& pieces() { return server_.servers.backup_pieces; }

  void expect_damaged(const std::string& how) {
    KeptFiles kept;
    const absl::Status status = client_->backup(kept).status();
    EXPECT_TRUE(absl::IsDataLoss(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("the backup came damaged: " + how));
    server_.servers.plan_backup(planned_);
  }

  const std::map<std::string, std::string> planned_ = {{"CURRENT", "one"}, {"empty", ""}, {"tables/1", "three"}};
  FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_P(BackupDownloadTest, FilesArriveCompleteAndAreCounted) {
  KeptFiles kept;
  const absl::StatusOr<BackupSize> size = client_->backup(kept);
  ASSERT_TRUE(size.ok()) << size.status();
  EXPECT_EQ(kept.files, planned_);
  EXPECT_EQ(kept.size.files, 3u);
  EXPECT_EQ(kept.size.bytes, 8u);
  EXPECT_EQ(size->files, 3u);
  EXPECT_EQ(size->bytes, 8u);
}

TEST_P(BackupDownloadTest, AFileMayArriveInManyMessages) {
  const v1::BackupResponse whole = pieces()[3];
  pieces()[3].clear_end();
  pieces()[3].set_data("th");
  v1::BackupResponse rest = whole;
  rest.clear_path();
  rest.set_data("ree");
  pieces().push_back(rest);
  KeptFiles kept;
  ASSERT_TRUE(client_->backup(kept).ok());
  EXPECT_EQ(kept.files, planned_);
}

TEST_P(BackupDownloadTest, AStreamThatEndsEarlyWithoutAnErrorIsDataLoss) {
  pieces().clear();
  expect_damaged("nothing came");
  pieces().pop_back();
  expect_damaged("less came than was announced");
  pieces()[3].clear_end();
  expect_damaged("its file \"tables/1\" has no end");
  pieces()[0].mutable_announced()->set_bytes(9);
  expect_damaged("less came than was announced");
}

TEST_P(BackupDownloadTest, MoreDataThanAnnouncedIsDataLoss) {
  pieces()[0].mutable_announced()->set_files(2);
  expect_damaged("more came than was announced");
  pieces()[0].mutable_announced()->set_bytes(7);
  expect_damaged("more came than was announced");
}

TEST_P(BackupDownloadTest, BytesWithAnotherHashAreDataLoss) {
  pieces()[1].set_data("onE");
  expect_damaged("its file \"CURRENT\" has another SHA-256 than the server says");
  pieces()[1].mutable_end()->set_bytes(4);
  expect_damaged("its file \"CURRENT\" has another size than the server says");
  pieces()[2].mutable_end()->clear_sha256();
  expect_damaged("its file \"empty\" has another SHA-256 than the server says");
}

TEST_P(BackupDownloadTest, AFileEndsOnlyAfterItsHashIsVerified) {
  pieces()[1].set_data("onE");
  KeptFiles kept;
  EXPECT_FALSE(client_->backup(kept).ok());
  EXPECT_THAT(kept.begun, ElementsAre("CURRENT"));
  EXPECT_THAT(kept.files, IsEmpty());
}

TEST_P(BackupDownloadTest, MessagesOutOfOrderAreDataLoss) {
  pieces()[0].clear_announced();
  expect_damaged("the announcement is not exactly in the first message");
  pieces()[1].mutable_announced();
  expect_damaged("the announcement is not exactly in the first message");
  pieces()[0].set_path("CURRENT");
  expect_damaged("its first message contains more than the announcement");
  pieces()[1].clear_path();
  expect_damaged("bytes came that belong to no file");
  pieces()[1].clear_end();
  expect_damaged("its file \"CURRENT\" has no end");
  pieces()[0].mutable_announced()->set_files(kMaxBackupFiles + 1);
  expect_damaged("1048577 files are announced");
}

TEST_P(BackupDownloadTest, InvalidPathsAreRefusedBeforeTheSinkReceivesThem) {
  for (const std::string path : {"../x", "/etc/x", "a/../../x", "a\nb"}) {
    pieces()[1].set_path(path);
    KeptFiles kept;
    EXPECT_TRUE(absl::IsDataLoss(client_->backup(kept).status())) << path;
    EXPECT_THAT(kept.begun, IsEmpty());
  }
  pieces()[2].set_path("CURRENT");
  pieces()[1].set_path("CURRENT");
  expect_damaged("its file \"CURRENT\" comes twice");
}

TEST_P(BackupDownloadTest, AnErrorOfTheSinkEndsTheBackup) {
  KeptFiles kept;
  kept.refused = "empty";
  const absl::Status status = client_->backup(kept).status();
  EXPECT_EQ(status, absl::ResourceExhaustedError("no room here"));
  EXPECT_THAT(kept.begun, ElementsAre("CURRENT", "empty"));
}

TEST_P(BackupDownloadTest, AnErrorOfTheServerIsReturned) {
  server_.servers.backup_end = {grpc::StatusCode::UNAVAILABLE, "planned"};
  KeptFiles kept;
  EXPECT_TRUE(absl::IsUnavailable(client_->backup(kept).status())) << "also after the last file was received";
}

INSTANTIATE_TEST_SUITE_P(Ways, BackupDownloadTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
