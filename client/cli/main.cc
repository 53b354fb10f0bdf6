// The program `locus`.
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "client/cli/context.h"
#include "client/cli/run.h"

int main(int argc, char** argv) {
  using locus::cli::Progress;
  const Progress progress = isatty(STDERR_FILENO) != 0 ? Progress::kLive : Progress::kSilent;
  locus::cli::Context context(std::cout, std::cerr, progress);
  if (const char* const scene = std::getenv("LOCUS_SCENE")) context.use_scene(scene);
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  return static_cast<int>(locus::cli::run_line(arguments, context));
}
