// Result of running a command of the command line within the test's process.
#ifndef LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_
#define LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_

#include <string>

#include "client/cli/failure.h"

namespace locus::test {

struct Outcome {
  cli::ExitCode code;
  std::string out;
  std::string err;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_
