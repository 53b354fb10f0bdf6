// Fixture for tests of the command line against a server within the test's process.
#ifndef LOCUS_TESTS_SUPPORT_CLI_TEST_H_
#define LOCUS_TESTS_SUPPORT_CLI_TEST_H_

#include <string>
#include <vector>

#include "client/cli/output.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {

class CliTest : public RpcTest {
 protected:
  using RpcTest::RpcTest;

  Outcome run(const std::vector<std::string>& line) { return run_cli(running_.address(), line); }

  // Runs a line that must succeed, and returns its output.
  cli::Json json_of(std::vector<std::string> line) {
    line.insert(line.begin(), {"-o", "json"});
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return cli::Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }

  // Returns the names of all scenes.
  std::vector<std::string> scenes() {
    std::vector<std::string> names;
    const cli::Json list = json_of({"scene", "list"});
    for (const cli::Json& scene : list["scenes"]) names.push_back(scene["name"]);
    return names;
  }
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLI_TEST_H_
