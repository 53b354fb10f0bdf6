#include "client/cli/levels/import/syscall_filter.h"

#include <gtest/gtest.h>

#include "client/cli/levels/import/import_child.h"
#include "client/cli/levels/import/import_file.h"
#include "core/base/sanitized_build.h"
#include "tests/client/cli/levels/import/test_files.h"
#include "tests/support/machine_features.h"

namespace locus::cli {
namespace {

bool can_filter() { return test::kernel_filters_system_calls() && !kSanitizedBuild; }

// The filter is loaded in a child process, since it stays until the end of a process; import_child_test.cc tests which
// calls it forbids.
TEST(SyscallFilterTest, AnImportRunsUnderTheFilter) {
  if (!can_filter()) GTEST_SKIP() << "the kernel has no filter of system calls, or a sanitizer needs other calls";
  const TempFolder folder;
  const auto level = import_file(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), {});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_TRUE(level->filtered);
}

TEST(SyscallFilterTest, ASecondFilterIsRefusedAndTheFirstStays) {
  if (!can_filter()) GTEST_SKIP() << "no filter of system calls here";
  const auto answer = run_in_child("x", {}, [] { return std::string(load_syscall_filter(3) ? "loaded" : "refused"); });
  EXPECT_FALSE(answer.ok() && answer->bytes == "loaded");
}

}  // namespace
}  // namespace locus::cli
