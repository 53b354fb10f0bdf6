#include "client/cli/levels/import/import_child.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "core/base/sanitized_build.h"
#include "tests/client/cli/levels/import/test_files.h"
#include "tests/support/machine_features.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of_child(absl::FunctionRef<std::string()> produce, const ChildLimits& limits = {}) {
  const absl::StatusOr<ChildAnswer> answer = run_in_child("x.fbx", limits, produce);
  return answer.ok() ? "no error" : std::string(answer.status().message());
}

// Returns whether the filter of system calls works on this machine.
bool has_filter() { return test::kernel_filters_system_calls() && !kSanitizedBuild; }

bool has_children() { return waitpid(-1, nullptr, WNOHANG) >= 0 || errno != ECHILD; }

[[noreturn]] std::string work_forever() {
  std::atomic<uint64_t> steps = 0;
  while (true) ++steps;
}

// Recurses `levels` deep; each level takes about 4 kB of stack.
uint64_t descend(uint64_t levels) {
  std::array<volatile char, 4096> frame;
  frame[levels % frame.size()] = static_cast<char>(levels);
  return levels == 0 ? 0 : descend(levels - 1) + static_cast<uint8_t>(frame[levels % frame.size()]);
}

class ImportChildTest : public ::testing::Test {
 protected:
  void TearDown() override { EXPECT_FALSE(has_children()) << "a child was not collected"; }
};

TEST_F(ImportChildTest, TheAnswerOfAnySizeComesBackUnchanged) {
  for (const size_t size : {size_t{0}, size_t{1}, size_t{65536}, size_t{5'000'000}}) {
    std::string bytes(size, 'a');
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 7 + i / 256);
    const absl::StatusOr<ChildAnswer> answer = run_in_child("x", {}, [&] { return bytes; });
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->bytes, bytes);
  }
}

TEST_F(ImportChildTest, TheParentKeepsItsMemory) {
  int value = 1;
  ASSERT_TRUE(run_in_child("x", {}, [&] {
                value = 2;
                return std::string();
              }).ok());
  EXPECT_EQ(value, 1);
}

TEST_F(ImportChildTest, ACrashIsOneErrorThatNamesTheFileAndTheSignal) {
  const absl::StatusOr<ChildAnswer> answer = run_in_child("x.fbx", {}, []() -> std::string { std::abort(); });
  EXPECT_EQ(answer.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(answer.status().message(),
            "the importer crashed (signal 6) while reading x.fbx: the file is damaged or made to do harm; export it "
            "again or convert it to GLB");
}

TEST_F(ImportChildTest, AnEndlessRecursionIsACrash) {
  if (kSanitizedBuild) GTEST_SKIP() << "sanitizers handle the signal";
  EXPECT_THAT(error_of_child([] { return std::to_string(descend(1'000'000'000)); }),
              StartsWith("the importer crashed (signal 11) while reading x.fbx: "));
}

TEST_F(ImportChildTest, AnExceptionAndAnEarlyEndAreErrors) {
  EXPECT_THAT(error_of_child([]() -> std::string { throw std::runtime_error("bad"); }),
              StartsWith("the importer threw an exception while reading x.fbx"));
  EXPECT_THAT(error_of_child([]() -> std::string { _exit(7); }), StartsWith("the importer ended with code 7 while"));
}

TEST_F(ImportChildTest, MoreTimeThanTheLimitIsRefusedByName) {
  ChildLimits limits;
  limits.seconds = 1;
  const absl::StatusOr<ChildAnswer> answer = run_in_child("x.fbx", limits, work_forever);
  EXPECT_EQ(answer.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(answer.status().message(),
            "reading x.fbx has taken longer, the limit import_seconds is 1: split it into several files");
}

TEST_F(ImportChildTest, MoreProcessorTimeThanTheLimitIsRefusedByName) {
  ChildLimits limits;
  limits.cpu_seconds = 1;
  EXPECT_THAT(error_of_child(work_forever, limits), HasSubstr("the limit import_cpu_seconds is 1"));
}

TEST_F(ImportChildTest, MoreMemoryThanTheLimitIsRefusedByName) {
  if (kSanitizedBuild) GTEST_SKIP() << "sanitizers reserve more address space than any limit";
  ChildLimits limits;
  limits.memory_bytes = 64 << 20;
  const std::string message = error_of_child([] { return std::string(size_t{128} << 20, 'x'); }, limits);
  EXPECT_EQ(message,
            "reading x.fbx has taken more memory, the limit import_memory is 67108864: split it into several files");
}

TEST_F(ImportChildTest, TheMemoryLimitGrowsWithTheFileUpToAMaximum) {
  EXPECT_EQ(limits_for(0).memory_bytes, kImportMemoryBase);
  EXPECT_EQ(limits_for(1000).memory_bytes, kImportMemoryBase + 1000 * kImportMemoryFactor);
  EXPECT_LE(limits_for(UINT64_MAX).memory_bytes, kMaxImportMemory);
}

TEST_F(ImportChildTest, TheChildHasNoFilesOfTheParent) {
  const int low = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int file = fcntl(low, F_DUPFD, 100);  // without O_CLOEXEC
  close(low);
  ASSERT_GE(file, 100);
  const absl::StatusOr<ChildAnswer> answer =
      run_in_child("x", {}, [&] { return std::string(1, lseek(file, 0, SEEK_CUR) < 0 ? 'n' : 'y'); });
  close(file);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->bytes, "n");
}

TEST_F(ImportChildTest, TheChildCanOpenNothing) {
  const TempFolder folder;
  const std::string path = folder.write("secret", "text");
  const absl::StatusOr<ChildAnswer> answer = run_in_child("x", {}, [&] {
    const bool read = open(path.c_str(), O_RDONLY) >= 0 || std::ifstream(path).good();
    const bool wrote = open((path + "2").c_str(), O_WRONLY | O_CREAT, 0600) >= 0;
    return std::string(read || wrote ? "opened" : "refused");
  });
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->bytes, "refused");
}

TEST_F(ImportChildTest, ForbiddenSystemCallsEndTheChild) {
  if (!has_filter()) GTEST_SKIP() << "no filter of system calls here";
  const auto expect_forbidden = [](absl::FunctionRef<void()> call) {
    EXPECT_THAT(error_of_child([&] {
                  call();
                  return std::string("done");
                }),
                StartsWith("the importer made a forbidden system call (signal 31) while reading x.fbx: "));
  };
  expect_forbidden([] { socket(AF_INET, SOCK_STREAM, 0); });
  expect_forbidden([] { socket(AF_UNIX, SOCK_STREAM, 0); });
  expect_forbidden([] { execl("/bin/true", "true", nullptr); });
  expect_forbidden([] { fork(); });
  expect_forbidden([] { kill(getppid(), 0); });
  expect_forbidden([] { unlink("/nowhere"); });
  expect_forbidden([] { prctl(PR_SET_DUMPABLE, 1); });
  expect_forbidden([] { mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); });
}

TEST_F(ImportChildTest, TheChildWritesOnlyToItsPipe) {
  if (!has_filter()) GTEST_SKIP() << "no filter of system calls here";
  const absl::StatusOr<ChildAnswer> answer =
      run_in_child("x", {}, [] { return std::string(1, write(STDOUT_FILENO, "x", 1) < 0 ? 'n' : 'y'); });
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->bytes, "n");
}

// If a thread holds a lock during a fork, the lock stays locked in the child. Threads that allocate, throw and format
// all the time often hold such locks.
TEST_F(ImportChildTest, AChildOfAProcessWithBusyThreadsAnswers) {
  if (kSanitizedBuild) GTEST_SKIP() << "the allocator of AddressSanitizer 16 does not survive such a fork";
  std::atomic<bool> stop = false;
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&stop] {
      while (!stop) {
        try {
          throw std::runtime_error(std::to_string(1.5) + std::string(1000, 'x'));
        } catch (const std::runtime_error&) {
        }
      }
    });
  }
  ChildLimits limits;
  limits.seconds = 60;
  for (int round = 0; round < 100; ++round) {
    const absl::StatusOr<ChildAnswer> answer = run_in_child("x", limits, [] {
      std::string bytes;
      for (int i = 0; i < 100; ++i) {
        try {
          throw std::runtime_error(std::to_string(i));
        } catch (const std::runtime_error& error) {
          bytes += error.what() + std::string(10'000, 'y');
        }
      }
      return bytes;
    });
    EXPECT_TRUE(answer.ok()) << answer.status();
    if (!answer.ok()) break;
  }
  stop = true;
  for (std::thread& thread : threads) thread.join();
}

TEST_F(ImportChildTest, ImportsAtOnceGetTheirOwnAnswers) {
  if (kSanitizedBuild) GTEST_SKIP() << "the allocator of AddressSanitizer 16 does not survive such a fork";
  std::vector<std::thread> threads;
  std::atomic<int> wrong = 0;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([i, &wrong] {
      for (int round = 0; round < 10; ++round) {
        const std::string expected(static_cast<size_t>(100'000 + i), static_cast<char>('a' + i));
        const absl::StatusOr<ChildAnswer> answer = run_in_child("x", {}, [&] { return expected; });
        if (!answer.ok() || answer->bytes != expected) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(ImportChildTest, SignalsOfTheCallerAreNotInherited) {
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGXCPU);
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
  ChildLimits limits;
  limits.cpu_seconds = 1;
  const std::string message = error_of_child(work_forever, limits);
  ASSERT_EQ(pthread_sigmask(SIG_SETMASK, &before, nullptr), 0);
  EXPECT_THAT(message, HasSubstr("import_cpu_seconds"));
}

}  // namespace
}  // namespace locus::cli
