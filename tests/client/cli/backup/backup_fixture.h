// Fixture for tests of backup and restore: a fake server that sends a planned backup, a temporary folder, and a
// function that runs command lines.
#ifndef LOCUS_TESTS_CLIENT_CLI_BACKUP_BACKUP_FIXTURE_H_
#define LOCUS_TESTS_CLIENT_CLI_BACKUP_BACKUP_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli::testing {

using Files = std::map<std::string, std::string>;

struct Outcome {
  ExitCode code;
  std::string out;
  std::string err;
};

// Returns the bytes of all files below `directory`, by relative path.
inline Files files_of(const std::string& directory) {
  Files files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[entry.path().lexically_relative(directory).string()] = bytes.str();
  }
  return files;
}

class BackupFixture : public ::testing::Test {
 protected:
  BackupFixture() { server_.servers.plan_backup(planned_); }

  Outcome run(std::vector<std::string> arguments, Progress progress = Progress::kSilent) {
    arguments.insert(arguments.begin(), {"--address", server_.address()});
    std::ostringstream out;
    std::ostringstream err;
    Context context(out, err, progress);
    const ExitCode code = run_line(arguments, context);
    return {code, out.str(), err.str()};
  }

  Json json_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-o", "json"});
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }

  const Files planned_ = {{"CURRENT", "MANIFEST-1\n"}, {"empty", ""}, {"tables/000007.sst", std::string("s\0\xFF", 3)}};
  test::TemporaryFolder folder_;
  const std::string backup_ = folder_.file("backup");
  client::testing::FakeServer server_;
};

}  // namespace locus::cli::testing

#endif  // LOCUS_TESTS_CLIENT_CLI_BACKUP_BACKUP_FIXTURE_H_
