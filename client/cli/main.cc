// The program `locus`.
#include <unistd.h>

#include <iostream>
#include <string>
#include <vector>

#include "client/cli/context.h"
#include "client/cli/run.h"

int main(int argc, char** argv) {
  using locus::cli::Progress;
  const Progress progress = isatty(STDERR_FILENO) != 0 ? Progress::kLive : Progress::kSilent;
  locus::cli::Context context(std::cout, std::cerr, progress);
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  return static_cast<int>(locus::cli::run_line(arguments, context));
}
