// Main function of tests that are linked with planted bugs. Runs all tests once without a bug: all must pass. Then runs
// all tests once with each bug: at least one must fail. Each run is a process of its own.
#ifndef LOCUS_TESTS_SUPPORT_MUTANTS_H_
#define LOCUS_TESTS_SUPPORT_MUTANTS_H_

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "absl/types/span.h"
#include "core/base/planted_bug.h"

namespace locus::test {

struct Mutant {
  const char* name;
  PlantedBug bug;
};

// Runs all tests with the bug `bug` and returns the exit code: 0 if all tests pass, 1 if one fails, any other code if
// the run did not reach its end. If a failure is expected, the output of the tests goes to /dev/null.
inline int result_with(PlantedBug bug) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    planted_bug = bug;
    GTEST_FLAG_SET(fail_fast, bug != PlantedBug::kNone);  // one failure is enough to catch a bug
    if (bug != PlantedBug::kNone && std::freopen("/dev/null", "w", stdout) == nullptr) std::_Exit(2);
    std::_Exit(RUN_ALL_TESTS());
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

// Returns the exit code of the program: 0 if every bug is caught. `what` names the code with the bugs.
inline int run_mutants(const char* what, absl::Span<const Mutant> mutants) {
  if (result_with(PlantedBug::kNone) != 0) {
    std::puts("the tests fail without a planted bug");
    return 1;
  }
  int missed = 0;
  for (const Mutant& mutant : mutants) {
    const bool caught = result_with(mutant.bug) == 1;
    std::printf("%s: %s\n", mutant.name, caught ? "caught" : "MISSED");
    missed += caught ? 0 : 1;
  }
  std::printf("mutants of %s: %zu, missed: %d\n", what, mutants.size(), missed);
  return missed == 0 ? 0 : 1;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_MUTANTS_H_
