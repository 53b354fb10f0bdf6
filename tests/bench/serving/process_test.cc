#include "tests/bench/serving/process.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "tests/bench/frame/temporary_folder.h"

namespace locus::bench::serving {
namespace {

std::unique_ptr<Process> started(const TemporaryFolder& folder, const std::vector<std::string>& words) {
  auto process = Process::start("/bin/" + words.front(), words, folder.file("log"));
  EXPECT_TRUE(process.ok()) << process.status();
  return process.ok() ? *std::move(process) : nullptr;
}

TEST(ProcessTest, AMissingProgramIsNamed) {
  const TemporaryFolder folder;
  const auto process = Process::start("/no/such/program", {"program"}, folder.file("log"));
  EXPECT_EQ(process.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(process.status().message().find("/no/such/program"), absl::string_view::npos);
}

TEST(ProcessTest, EndsWithItsObject) {
  const TemporaryFolder folder;
  auto process = started(folder, {"sleep", "600"});
  ASSERT_NE(process, nullptr);
  const pid_t pid = process->pid();
  ASSERT_EQ(kill(pid, 0), 0);
  process.reset();
  EXPECT_NE(kill(pid, 0), 0);
}

TEST(ProcessTest, ItsOutputIsInItsLog) {
  const TemporaryFolder folder;
  auto process = started(folder, {"echo", "seven"});
  ASSERT_NE(process, nullptr);
  for (int i = 0; i < 1000 && !process->has_ended(); ++i) sleep_seconds(0.01);
  ASSERT_TRUE(process->has_ended());
  std::string word;
  std::ifstream(folder.file("log")) >> word;
  EXPECT_EQ(word, "seven");
}

TEST(ProcessTest, ItsMemoryFilesAndThreadsAreCounted) {
  const TemporaryFolder folder;
  const auto process = started(folder, {"sleep", "600"});
  ASSERT_NE(process, nullptr);
  for (int i = 0; i < 1000 && process->cpu_seconds() == 0; ++i) sleep_seconds(0.01);
  EXPECT_GT(process->cpu_seconds(), 0);
  EXPECT_GT(process->resident_bytes(), 0);
  EXPECT_GT(process->open_files(), 0);
  EXPECT_EQ(process->threads(), 1);
}

TEST(ProgramTest, IsFoundInThePathOrNotAtAll) {
  EXPECT_NE(program_in_path("sh"), "");
  EXPECT_EQ(program_in_path("no-such-program"), "");
  EXPECT_EQ(program_beside("no-such-program"), "");
}

}  // namespace
}  // namespace locus::bench::serving
