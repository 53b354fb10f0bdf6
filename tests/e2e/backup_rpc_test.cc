#include <filesystem>
#include <fstream>
#include <future>
#include <map>

#include "absl/strings/escaping.h"
#include "core/base/limits.h"
#include "tests/support/fake_log.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

// Size of a large file: far more than a connection buffers, so a server cannot send the whole file to a caller that
// does not read.
constexpr size_t kLargeBytes = size_t{64} << 20;

std::string bytes_of(size_t count) {
  std::string bytes(count, '\0');
  uint32_t state = 1;
  for (char& byte : bytes) byte = static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
  return bytes;
}

// A server with a data directory and a fake log, which can only make backups.
class BackupRpcTest : public ::testing::Test {
 protected:
  BackupRpcTest() { log_.files = {{"CURRENT", "MANIFEST-1\n"}, {"empty", ""}, {"tables/000007.sst", "seven"}}; }

  RunningServer& start() {
    server::ServerConfig config = test_config();
    config.data_dir = folder_.path();
    running_.emplace(config, &log_);
    return *running_;
  }

  // Makes a Backup call, appends its pieces to `pieces` and returns the status of the call.
  static grpc::Status back_up(Stubs& stubs, std::vector<v1::BackupResponse>* pieces) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto reader = stubs.server->Backup(&context, {});
    for (v1::BackupResponse piece; reader->Read(&piece);) pieces->push_back(piece);
    return reader->Finish();
  }

  // Drains the server until all calls have ended, then returns whether the data directory is empty.
  bool nothing_is_left() {
    running_->server().drain(kCallTimeout);
    return std::filesystem::is_empty(folder_.path());
  }

  TemporaryFolder folder_;
  FakeLog log_;
  std::optional<RunningServer> running_;
};

TEST_F(BackupRpcTest, EveryFileIsSentWithItsPathSizeAndHash) {
  std::vector<v1::BackupResponse> pieces;
  const grpc::Status status = back_up(start().stubs(), &pieces);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_THAT(pieces, SizeIs(4));
  EXPECT_EQ(pieces[0].ShortDebugString(), "announced { files: 3 bytes: 16 }");
  EXPECT_EQ(pieces[1].path(), "CURRENT");
  EXPECT_EQ(pieces[1].data(), "MANIFEST-1\n");
  EXPECT_EQ(pieces[1].end().bytes(), 11u);
  EXPECT_EQ(pieces[2].path(), "empty");
  EXPECT_EQ(pieces[2].data(), "");
  ASSERT_TRUE(pieces[2].has_end());
  EXPECT_EQ(absl::BytesToHexString(pieces[2].end().sha256()),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(pieces[3].path(), "tables/000007.sst");
  EXPECT_EQ(absl::BytesToHexString(pieces[3].end().sha256()),
            "3ba8d02b16fd2a01c1a8ba1a1f036d7ce386ed953696fa57331c2ac48a80b255");
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(BackupRpcTest, ALargeFileIsSentInPiecesOfAMebibyte) {
  const std::string bytes = bytes_of(3 * limits::kBackupPieceBytes + 5);
  log_.files = {{"large", bytes}, {"round", bytes.substr(0, limits::kBackupPieceBytes)}};
  std::vector<v1::BackupResponse> pieces;
  ASSERT_TRUE(back_up(start().stubs(), &pieces).ok());
  ASSERT_THAT(pieces, SizeIs(6));
  std::string together;
  for (size_t i = 1; i <= 4; ++i) {
    together += pieces[i].data();
    EXPECT_EQ(pieces[i].path(), i == 1 ? "large" : "");
    EXPECT_EQ(pieces[i].has_end(), i == 4);
    EXPECT_LE(pieces[i].data().size(), limits::kBackupPieceBytes);
  }
  EXPECT_TRUE(together == bytes);
  EXPECT_EQ(pieces[4].end().bytes(), bytes.size());
  EXPECT_EQ(absl::BytesToHexString(pieces[4].end().sha256()),
            "f8b9b24ce2391e6909784a8c46a8f40469a73c63cc0c3800b92fc37c80f2ef62");
  EXPECT_EQ(pieces[5].path(), "round");
  EXPECT_EQ(pieces[5].data().size(), limits::kBackupPieceBytes);
  EXPECT_TRUE(pieces[5].has_end());
}

TEST_F(BackupRpcTest, TheFeatureIsListedOnlyWithADataDirectory) {
  const auto features_of = [](Stubs& stubs) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse server;
    EXPECT_TRUE(stubs.server->GetServer(&context, {}, &server).ok());
    return std::vector<std::string>(server.features().begin(), server.features().end());
  };
  EXPECT_THAT(features_of(start().stubs()), Contains("backup"));
  RunningServer memory_only;
  EXPECT_THAT(features_of(memory_only.stubs()), Not(Contains("backup")));
}

TEST_F(BackupRpcTest, AServerWithoutADataDirectoryRefusesWithAdvice) {
  RunningServer memory_only;
  std::vector<v1::BackupResponse> pieces;
  const grpc::Status status = back_up(memory_only.stubs(), &pieces);
  expect_refused(status, {grpc::StatusCode::UNIMPLEMENTED, v1::REASON_NOT_SERVED, ""});
  EXPECT_THAT(status.error_message(), HasSubstr("--data-dir"));
  EXPECT_THAT(pieces, SizeIs(0));
}

TEST_F(BackupRpcTest, ASecondBackupIsRefusedWhileOneRuns) {
  std::promise<void> begun;
  std::promise<void> go_on;
  log_.afterwards = [&](const std::string&) {
    begun.set_value();
    go_on.get_future().wait();
    return absl::OkStatus();
  };
  Stubs& stubs = start().stubs();
  std::vector<v1::BackupResponse> first;
  std::future<grpc::Status> running = std::async(std::launch::async, [&] { return back_up(stubs, &first); });
  begun.get_future().wait();
  std::vector<v1::BackupResponse> second;
  const grpc::Status refused = back_up(stubs, &second);
  expect_refused(refused, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, ""});
  EXPECT_EQ(error_of(refused).limit(), "backups");
  EXPECT_GT(error_of(refused).retry_after_ms(), 0u);
  go_on.set_value();
  EXPECT_TRUE(running.get().ok());
  EXPECT_THAT(first, SizeIs(4));
  log_.afterwards = {};
  EXPECT_TRUE(back_up(stubs, &second).ok()) << "the one before has ended";
}

TEST_F(BackupRpcTest, OtherCallsAreAnsweredWhileABackupRuns) {
  std::promise<void> begun;
  std::promise<void> go_on;
  log_.afterwards = [&](const std::string&) {
    begun.set_value();
    go_on.get_future().wait();
    return absl::OkStatus();
  };
  Stubs& stubs = start().stubs();
  std::vector<v1::BackupResponse> pieces;
  std::future<grpc::Status> running = std::async(std::launch::async, [&] { return back_up(stubs, &pieces); });
  begun.get_future().wait();
  grpc::ClientContext context;
  set_timeout(context);
  v1::GetServerResponse server;
  EXPECT_TRUE(stubs.server->GetServer(&context, {}, &server).ok());
  for (const v1::Limit& limit : server.limits()) {
    if (limit.name() == "backups") {
      EXPECT_EQ(limit.used(), 1);
    }
  }
  go_on.set_value();
  EXPECT_TRUE(running.get().ok());
}

TEST_F(BackupRpcTest, WhenTheCallerCancelsTheCopyIsRemoved) {
  log_.files = {{"large", bytes_of(kLargeBytes)}};
  Stubs& stubs = start().stubs();
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs.server->Backup(&context, {});
  v1::BackupResponse piece;
  ASSERT_TRUE(reader->Read(&piece));
  ASSERT_TRUE(reader->Read(&piece));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("backup.partial")));
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(BackupRpcTest, ACallerThatDoesNotReadIsCancelledWhenTheServerEnds) {
  log_.files = {{"large", bytes_of(kLargeBytes)}};
  Stubs& stubs = start().stubs();
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs.server->Backup(&context, {});
  v1::BackupResponse piece;
  ASSERT_TRUE(reader->Read(&piece));
  running_->server().drain(std::chrono::milliseconds(0));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  while (reader->Read(&piece)) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

TEST_F(BackupRpcTest, ALeftoverCopyIsRemovedAtTheStart) {
  std::filesystem::create_directories(folder_.file("backup.partial/copy"));
  std::ofstream(folder_.file("backup.partial/copy/CURRENT")) << "old";
  start();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(BackupRpcTest, AWriteErrorIsReportedAndTheCopyIsRemoved) {
  log_.afterwards = [](const std::string&) { return absl::ResourceExhaustedError("the disk is full"); };
  std::vector<v1::BackupResponse> pieces;
  const grpc::Status status = back_up(start().stubs(), &pieces);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(), "the disk is full");
  EXPECT_THAT(pieces, SizeIs(0));
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(BackupRpcTest, AMissingDataDirectoryIsReportedWithItsPath) {
  server::ServerConfig config = test_config();
  config.data_dir = folder_.file("gone");
  RunningServer running(config, &log_);
  std::vector<v1::BackupResponse> pieces;
  const grpc::Status status = back_up(running.stubs(), &pieces);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr(folder_.file("gone/backup.partial")));
}

TEST_F(BackupRpcTest, ANonRegularFileIsDataLoss) {
  log_.afterwards = [](const std::string& path) {
    std::filesystem::create_directory_symlink("/nonexistent", path + "/elsewhere");
    return absl::OkStatus();
  };
  std::vector<v1::BackupResponse> pieces;
  const grpc::Status status = back_up(start().stubs(), &pieces);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_THAT(status.error_message(), HasSubstr("elsewhere"));
  EXPECT_TRUE(nothing_is_left());
}

TEST_F(BackupRpcTest, AFileThatShrinksWhileItIsReadIsDataLoss) {
  log_.files = {{"large", bytes_of(kLargeBytes)}};
  std::string file;
  log_.afterwards = [&](const std::string& path) {
    file = path + "/large";
    return absl::OkStatus();
  };
  Stubs& stubs = start().stubs();
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs.server->Backup(&context, {});
  v1::BackupResponse piece;
  ASSERT_TRUE(reader->Read(&piece));
  std::filesystem::resize_file(file, kLargeBytes / 2);
  while (reader->Read(&piece)) EXPECT_FALSE(piece.has_end());
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_THAT(status.error_message(), HasSubstr("large"));
  EXPECT_TRUE(nothing_is_left());
}

}  // namespace
}  // namespace locus::test
