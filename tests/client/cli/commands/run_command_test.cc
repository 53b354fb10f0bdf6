// Tests that run scripts against a real locusd: the committed examples, and copies of the examples with mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/run.h"
#include "tests/support/daemon_process.h"

namespace locus::cli {
namespace {

using test::DaemonProcess;
using test::TemporaryFolder;
using test::text_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kExamples = std::string(LOCUS_SOURCE_DIR) + "/client/cli/script/examples/";

struct Outcome {
  ExitCode code;
  std::string out;
  std::string err;
};

class RunCommandTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    daemon_ =
        new DaemonProcess({"--listen", "127.0.0.1:0", "--port-file", folder_->file("port")}, folder_->file("log"));
    address_ = absl::StrCat("127.0.0.1:", DaemonProcess::wait_for_port(folder_->file("port")));
  }
  static void TearDownTestSuite() {
    daemon_->signal(SIGTERM);
    EXPECT_EQ(daemon_->wait(), 0);
    delete daemon_;
    delete folder_;
  }

  static Outcome run(std::vector<std::string> arguments, const std::string& address = address_) {
    std::ostringstream out;
    std::ostringstream err;
    Context context(out, err, Progress::kSilent);
    arguments.insert(arguments.begin(), {"--address", address});
    const ExitCode code = run_line(arguments, context);
    return {code, out.str(), err.str()};
  }
  // Writes a script to a file that is removed after the test, and returns its path.
  std::string file_with(const std::string& text) {
    std::ofstream(file_) << text;
    return file_;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  static std::vector<std::string> examples() {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(kExamples)) paths.push_back(entry.path());
    return paths;
  }

 private:
  static TemporaryFolder* folder_;
  static DaemonProcess* daemon_;
  static std::string address_;
  const std::string file_ = absl::StrCat(::testing::TempDir(), "locus_run_command_", getpid(), ".locus");
};
TemporaryFolder* RunCommandTest::folder_ = nullptr;
DaemonProcess* RunCommandTest::daemon_ = nullptr;
std::string RunCommandTest::address_;

TEST_F(RunCommandTest, EveryExamplePassesTwice) {
  EXPECT_GE(examples().size(), 3u);
  for (const std::string& example : examples()) {
    for (int time = 0; time < 2; ++time) {
      const Outcome outcome = run({"run", example});
      EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
      EXPECT_THAT(outcome.err, HasSubstr(" expectations passed, 0 failed\n"));
    }
  }
}

TEST_F(RunCommandTest, EveryExamplePassesTheCheckWithoutServer) {
  for (const std::string& example : examples()) {
    const Outcome outcome = run({"run", example, "--dry-run"}, "unix:/nonexistent/locus.sock");
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_THAT(outcome.err, HasSubstr(" lines checked, "));
  }
}

TEST_F(RunCommandTest, ABrokenCopyFailsWithLineAndValue) {
  const std::string text = text_of(kExamples + "first_steps.locus");
  const size_t place = text.find("expect $shot.id == 7");
  ASSERT_NE(place, std::string::npos);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n');
  const std::string file = file_with(absl::StrReplaceAll(text, {{"expect $shot.id == 7", "expect $shot.id == 2"}}));
  const Outcome outcome = run({"run", file});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr(absl::StrCat(file, ":", line, ": expected $shot.id == 2, but it is 7\n")));
  EXPECT_THAT(outcome.err, HasSubstr("2 expectations passed, 1 failed\n"));
}

TEST_F(RunCommandTest, SettingsReachTheScript) {
  const Outcome outcome = run({"run", kExamples + "first_steps.locus", "--set", "scene=elsewhere", "-o", "ndjson"});
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\"name\":\"elsewhere\""));
  const Json end = Json::parse(outcome.err);
  EXPECT_EQ(end["failed"], 0);
  EXPECT_GT(end["passed"], 5);
}

TEST_F(RunCommandTest, WrongSettingsAndFilesAreRefused) {
  const std::string file = file_with("echo hi");
  EXPECT_EQ(run({"run", file, "--set", "novalue"}).code, ExitCode::kUsage);
  EXPECT_EQ(run({"run", file, "--set", "1x=2"}).code, ExitCode::kUsage);
  EXPECT_EQ(run({"run", "/nonexistent/x.locus"}).code, ExitCode::kNotFound);
  EXPECT_EQ(run({"run", file_with("end")}).code, ExitCode::kUsage);
}

TEST_F(RunCommandTest, AMistakeInTheLastLinePreventsTheFirstFromRunning) {
  const Outcome outcome = run({"run", file_with("echo never\nquery ray arena\n")});
  EXPECT_EQ(outcome.code, ExitCode::kUsage);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, HasSubstr(".locus:2: give --from and --dir"));
}

TEST_F(RunCommandTest, ABatchHasTheEffectOfItsLines) {
  const Outcome outcome = run({"run", file_with(R"(
scene create order --if-absent
use order
remove --all
insert point --id 1 --at 0,0,0
begin
  remove --id 1
  insert point --id 1 --at 5,0,0
  move --id 1 --to 6,0,0
commit -> ack
expect $ack.refused == 0
get --id 1 -> one
expect $one.position == 6,0,0
expect $one.revision == $ack.revision
wait --revision $ack.revision -> ready
expect $ready.revision == $ack.revision
)")});
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

}  // namespace
}  // namespace locus::cli
