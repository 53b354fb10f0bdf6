// Tests of the program as a child process: its exit codes, standard output and standard error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

#include "tests/client/lib/fake_server.h"
#include "tests/support/built_program.h"

namespace locus::cli {
namespace {

using client::testing::FakeServer;
using ::testing::HasSubstr;

struct Exit {
  int code = -1;
  std::string text;  // standard output and standard error, mixed
};

Exit run_program(const std::string& environment, const std::string& arguments) {
  const std::string line = environment + " " + test::built_program("locus") + " " + arguments + " 2>&1";
  FILE* const pipe = popen(line.c_str(), "r");
  Exit exit;
  std::array<char, 4096> part{};
  while (const size_t read = fread(part.data(), 1, part.size(), pipe)) exit.text.append(part.data(), read);
  const int status = pclose(pipe);
  exit.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return exit;
}

TEST(ExitCodeTest, HelpExitsZero) {
  const Exit exit = run_program("", "--help");
  EXPECT_EQ(exit.code, 0);
  EXPECT_THAT(exit.text, HasSubstr("Examples:"));
}

TEST(ExitCodeTest, AWrongLineExitsTwo) { EXPECT_EQ(run_program("", "query sphere").code, 2); }

TEST(ExitCodeTest, AnUnreachableServerExitsThree) {
  const Exit exit = run_program("LOCUS_ADDRESS=unix:/nonexistent/locus.sock", "limits");
  EXPECT_EQ(exit.code, 3);
  EXPECT_THAT(exit.text, HasSubstr("nothing answers at unix:/nonexistent/locus.sock: start one with `locusd`"));
}

TEST(ExitCodeTest, DeniedExitsFourNotFoundFiveFailedOneAndSuccessZero) {
  FakeServer server;
  const std::string environment = "LOCUS_ADDRESS=" + server.address();
  EXPECT_EQ(run_program(environment, "health").code, 0);
  EXPECT_EQ(run_program(environment, "scene describe nowhere").code, 5);
  server.scenes.denied = true;
  EXPECT_EQ(run_program(environment, "scene delete arena").code, 4);
  server.updates.refused_ticks = {0};
  EXPECT_EQ(run_program(environment, "remove arena --all").code, 1);
}

}  // namespace
}  // namespace locus::cli
