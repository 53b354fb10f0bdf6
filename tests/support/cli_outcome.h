// Runs a line of the command line within the test's process, and its result.
#ifndef LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_
#define LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_

#include <sstream>
#include <string>
#include <vector>

#include "client/cli/context.h"
#include "client/cli/failure.h"
#include "client/cli/run.h"

namespace locus::test {

struct Outcome {
  cli::ExitCode code;
  std::string out;
  std::string err;
};

// Runs a line of `locus`, without the program's name, against the server at `address`.
inline Outcome run_cli(const std::string& address, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--address", address});
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  const cli::ExitCode code = cli::run_line(arguments, context);
  return {code, out.str(), err.str()};
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLI_OUTCOME_H_
