// Progress of the programs on a terminal, on a pipe, and in silence.
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"
#include "tests/support/terminal_run.h"

namespace locus::test {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr char kErase[] = "\r\x1b[K";

class ProgressTest : public ::testing::Test {
 protected:
  void SetUp() override {
    daemon_.start();
    create_scene(daemon_.stubs(), "world");
    for (const char* const size : {"1", "2"})
      std::ofstream(folder_.file(absl::StrCat("corner", size, ".obj")))
          << "v 0 0 0\nv 1 0 0\nv 0 " << size << " 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n";
    std::ofstream rows(folder_.file("rows.csv"));
    rows << "id,at.x,at.y,at.z,radius\n";
    for (int i = 1; i <= 100; ++i) rows << i << "," << 3 * i << ",0,0,1\n";
    std::ofstream rays(folder_.file("rays.csv"));
    rays << "from.x,from.y,from.z,dir.x,dir.y,dir.z\n";
    for (int i = 1; i <= 100; ++i) rays << 3 * i << ",9,0,0,-1,0\n";
  }

  ProgramRun run(std::vector<std::string> arguments, ErrorTo error_to) {
    arguments.insert(arguments.begin(), {"--address", "127.0.0.1:" + std::to_string(daemon_.port())});
    return run_program("locus", std::move(arguments), error_to);
  }

  // Runs the line with progress. Expects success, every phase, and on a terminal that the line is erased at the end.
  void expect_phases(std::vector<std::string> arguments, const std::vector<std::string>& phases, ErrorTo error_to) {
    arguments.insert(arguments.begin(), {"--progress", "always"});
    expect_phases_of(run(arguments, error_to), phases, error_to);
  }
  static void expect_phases_of(const ProgramRun& done, const std::vector<std::string>& phases, ErrorTo error_to) {
    EXPECT_EQ(done.exit_code, 0) << done.err;
    for (const std::string& phase : phases) EXPECT_THAT(done.err, HasSubstr(phase));
    if (error_to == ErrorTo::kTerminal) {
      EXPECT_THAT(done.err, HasSubstr(kErase + phases.front()));
      EXPECT_THAT(done.err, EndsWith(kErase));
      EXPECT_THAT(done.err, Not(HasSubstr("\n"))) << "one line, redrawn";
    } else {
      EXPECT_THAT(done.err, Not(HasSubstr("\x1b")));
      EXPECT_THAT(done.err, EndsWith("\n"));
    }
    EXPECT_THAT(done.out, Not(HasSubstr(phases.front() + " "))) << "progress is never on the standard output";
  }

  KeptDaemon daemon_;
  TemporaryFolder folder_;
};

TEST_F(ProgressTest, LongJobsShowTheirPhases) {
  for (const ErrorTo error_to : {ErrorTo::kTerminal, ErrorTo::kPipe}) {
    const std::string mark = error_to == ErrorTo::kTerminal ? "terminal" : "pipe";
    // Meshes of their own: the server answers the upload of a mesh that it knows before the whole mesh is sent.
    const std::string size = error_to == ErrorTo::kTerminal ? "1" : "2";
    expect_phases({"import", folder_.file("corner" + size + ".obj"), "--scene", "world", "--mesh", mark},
                  {"reading", "uploading " + mark, "building the tree of " + mark, "placing"}, error_to);
    expect_phases({"generate", "city", "--triangles", size + "000", "--scene", "world", "--mesh", mark + "-city"},
                  {"generating city", "uploading " + mark, "building the tree of " + mark, "placing"}, error_to);
    expect_phases({"insert", "world", "ball", "--upsert", "--from-csv", folder_.file("rows.csv")},
                  {"sending " + folder_.file("rows.csv")}, error_to);
    expect_phases({"render", "world", folder_.file("world.png"), "--size", "32x24"}, {"rendering", "writing"},
                  error_to);
    expect_phases({"export", "world", folder_.file("world.glb")}, {"reading world", "downloading", "writing"},
                  error_to);
    expect_phases({"backup", folder_.file(mark)}, {"backing up", "syncing"}, error_to);
    expect_phases({"restore", folder_.file(mark), "--verify-only"}, {"verifying"}, error_to);
    expect_phases({"demo", "--seconds", "0.2", "--objects", "100", "--triangles", size + "00", "--checks", "10",
                   "--edge-rays", "10"},
                  {"generating city", "uploading", "building", "placing", "moving 100 objects", "checking"}, error_to);
  }
}

TEST_F(ProgressTest, CheckAndRepairShowTheirPhases) {
  ASSERT_EQ(daemon_.stop(), 0);
  for (const ErrorTo error_to : {ErrorTo::kTerminal, ErrorTo::kPipe}) {
    for (const std::string task : {"check", "repair"})
      expect_phases_of(run_program("locusd", {task, daemon_.directory(), "--progress", "always"}, error_to),
                       {"opening", "checking"}, error_to);
  }
}

TEST_F(ProgressTest, StandardOutputIsTheSameWithProgress) {
  run({"insert", "world", "ball", "--from-csv", folder_.file("rows.csv")}, ErrorTo::kPipe);
  const std::string made = folder_.file("made");
  run({"backup", folder_.file("kept")}, ErrorTo::kPipe);
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {"-o", "csv", "query", "ray", "world", "--from-csv", folder_.file("rays.csv")},
           {"generate", "terrain", "--triangles", "2000", "--out", made},
           {"export", "world", made + ".glb"},
           {"-o", "ndjson", "query", "ray", "world", "--mode", "any", "--from-csv", folder_.file("rays.csv")},
           {"restore", folder_.file("kept"), "--verify-only"}}) {
    std::vector<std::string> outputs;
    for (const std::string when : {"never", "always", "auto"}) {
      for (const ErrorTo error_to : {ErrorTo::kTerminal, ErrorTo::kPipe}) {
        std::filesystem::remove_all(made);
        std::vector<std::string> arguments = line;
        arguments.insert(arguments.begin(), {"--progress", when});
        const ProgramRun done = run(arguments, error_to);
        EXPECT_EQ(done.exit_code, 0) << done.err;
        outputs.push_back(done.out);
        const bool silent = when == "never" || (when == "auto" && error_to == ErrorTo::kPipe);
        if (silent) {
          EXPECT_THAT(done.err, IsEmpty()) << line.front();
        } else {
          EXPECT_THAT(done.err, Not(IsEmpty())) << line.front();
        }
      }
    }
    EXPECT_FALSE(outputs.front().empty());
    for (const std::string& output : outputs) EXPECT_EQ(output, outputs.front()) << line.front();
  }
}

}  // namespace
}  // namespace locus::test
