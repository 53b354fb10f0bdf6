// Backups by the command line against a real server: a backup is made and restored to a data directory.
#include <atomic>
#include <filesystem>
#include <sstream>
#include <thread>

#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/fake_log.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

Outcome run(const std::string& address, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--address", address});
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  const cli::ExitCode code = cli::run_line(arguments, context);
  return {code, out.str(), err.str()};
}

TEST(BackupTest, ARestoredDirectoryHasTheFilesThatTheLogCopied) {
  const TemporaryFolder folder;
  const std::string large(5'000'000, 'x');
  FakeLog log;
  log.files = {{"CURRENT", "MANIFEST-1\n"}, {"empty", ""}, {"tables/000007.sst", large}};
  server::ServerConfig config = test_config();
  config.data_dir = folder.file("live");
  std::filesystem::create_directory(config.data_dir);
  const RunningServer server(config, &log);
  const Outcome backed_up = run(server.address(), {"backup", folder.file("backup")});
  ASSERT_EQ(backed_up.code, cli::ExitCode::kOk) << backed_up.err;
  EXPECT_THAT(backed_up.out, HasSubstr("5000011"));
  EXPECT_TRUE(std::filesystem::is_empty(config.data_dir));
  const Outcome restored = run(server.address(), {"restore", folder.file("backup"), folder.file("data")});
  ASSERT_EQ(restored.code, cli::ExitCode::kOk) << restored.err;
  for (const auto& [path, bytes] : log.files) EXPECT_TRUE(text_of(folder.file("data/" + path)) == bytes) << path;
  EXPECT_FALSE(std::filesystem::exists(folder.file("data/SHA256SUMS")));
}

// Inserts point `number` at x = `number`. Returns whether the update was acknowledged.
bool put_point(Stubs& stubs, uint64_t number) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::ApplyUpdatesRequest request;
  request.set_scene("arena");
  v1::Insert* const insert = request.mutable_batch()->add_inserts();
  insert->mutable_point();
  insert->add_ids(number);
  for (const double x : {static_cast<double>(number), 0.0, 0.0}) insert->add_positions_f64(x);
  v1::ApplyUpdatesResponse response;
  return stubs.updates->ApplyUpdates(&context, request, &response).ok();
}

TEST(BackupTest, ABackupUnderWritesServesEveryUpdateAcknowledgedBeforeIt) {
  KeptDaemon daemon, copy;
  const TemporaryFolder folder;
  daemon.start();
  const uint64_t epoch = create_scene(daemon.stubs(), "arena").epoch();
  std::atomic<uint64_t> acked = 0;
  std::atomic<bool> over = false;
  std::thread writer([&] {
    while (!over && put_point(daemon.stubs(), acked + 1)) ++acked;
  });
  while (acked < 50) std::this_thread::yield();
  const uint64_t before = acked;
  const Outcome backed_up = run(absl::StrCat("127.0.0.1:", daemon.port()), {"backup", folder.file("backup")});
  const uint64_t after = acked + 1;
  EXPECT_EQ(backed_up.code, cli::ExitCode::kOk) << backed_up.err;
  EXPECT_EQ(run("", {"restore", folder.file("backup"), copy.directory()}).code, cli::ExitCode::kOk);
  over = true;
  writer.join();
  EXPECT_EQ(copy.maintain("check"), 0) << copy.printed();
  copy.start();
  const std::map<uint64_t, PlacedPoint> points = points_of(copy.stubs(), "arena");
  EXPECT_GE(points.size(), before);
  EXPECT_LE(points.size(), after);
  uint64_t expected = 0;
  for (const auto& [id, point] : points) EXPECT_EQ(id, ++expected);
  EXPECT_EQ(get_scene(copy.stubs(), "arena").revision(), points.size());
  const uint64_t other_epoch = get_scene(copy.stubs(), "arena").epoch();
  EXPECT_NE(other_epoch, epoch) << "two histories of one name";
  EXPECT_TRUE(put_point(copy.stubs(), points.size() + 1));
  EXPECT_EQ(get_scene(daemon.stubs(), "arena").epoch(), epoch);
  EXPECT_TRUE(put_point(daemon.stubs(), acked + 1)) << "the first goes on";
  copy.kill();
  copy.start();
  EXPECT_EQ(get_scene(copy.stubs(), "arena").epoch(), other_epoch);
}

TEST(BackupTest, AServerWithoutADataDirectoryAdvisesToSetOne) {
  const TemporaryFolder folder;
  const RunningServer server;
  const Outcome refused = run(server.address(), {"backup", folder.file("backup")});
  EXPECT_EQ(refused.code, cli::ExitCode::kFailed);
  EXPECT_THAT(refused.err, HasSubstr("a server started with --data-dir can be backed up"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace locus::test
