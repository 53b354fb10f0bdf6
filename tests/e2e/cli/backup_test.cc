// Backups through the command line against a real server, from the log's copy to a data directory.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/cli/run.h"
#include "tests/support/fake_log.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  cli::ExitCode code;
  std::string out;
  std::string err;
};

Outcome run(const RunningServer& server, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--address", server.address()});
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  const cli::ExitCode code = cli::run_line(arguments, context);
  return {code, out.str(), err.str()};
}

std::string bytes_of(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST(BackupTest, WhatTheLogCopiedIsTheDataDirectoryThatIsRestored) {
  const TemporaryFolder folder;
  const std::string large(5'000'000, 'x');
  FakeLog log;
  log.files = {{"CURRENT", "MANIFEST-1\n"}, {"empty", ""}, {"tables/000007.sst", large}};
  server::ServerConfig config = test_config();
  config.data_dir = folder.file("live");
  std::filesystem::create_directory(config.data_dir);
  const RunningServer server(config, &log);
  const Outcome backed_up = run(server, {"backup", folder.file("backup")});
  ASSERT_EQ(backed_up.code, cli::ExitCode::kOk) << backed_up.err;
  EXPECT_THAT(backed_up.out, HasSubstr("5000011"));
  EXPECT_TRUE(std::filesystem::is_empty(config.data_dir));
  const Outcome restored = run(server, {"restore", folder.file("backup"), folder.file("data")});
  ASSERT_EQ(restored.code, cli::ExitCode::kOk) << restored.err;
  for (const auto& [path, bytes] : log.files) EXPECT_TRUE(bytes_of(folder.file("data/" + path)) == bytes) << path;
  EXPECT_FALSE(std::filesystem::exists(folder.file("data/SHA256SUMS")));
}

TEST(BackupTest, AServerThatKeepsNothingSaysWhatToDoInstead) {
  const TemporaryFolder folder;
  const RunningServer server;
  const Outcome refused = run(server, {"backup", folder.file("backup")});
  EXPECT_EQ(refused.code, cli::ExitCode::kFailed);
  EXPECT_THAT(refused.err, HasSubstr("a server started with --data-dir can be backed up"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace locus::test
