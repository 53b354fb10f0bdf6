// Entry point of the program `locus`.
#include <malloc.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "client/cli/context.h"
#include "client/cli/run.h"
#include "client/lib/saved_contexts.h"

namespace {

// Makes malloc reuse freed memory instead of returning it to the kernel. Messages can be several megabytes large, and
// by default glibc returns blocks of this size at every free(), which halves throughput.
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  keep_freed_memory();
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // gRPC's log would repeat the errors that commands print
  using locus::cli::Progress;
  const Progress progress = isatty(STDERR_FILENO) != 0 ? Progress::kLive : Progress::kSilent;
  locus::cli::Context context(std::cout, std::cerr, progress);
  context.set_contexts_path(locus::client::default_contexts_path());
  // Take the token from the environment. No option passes a token directly, because other users of the machine can see
  // the arguments of a process.
  if (const char* const token = std::getenv("LOCUS_TOKEN")) context.options().connection.credentials.token = token;
  if (const char* const scene = std::getenv("LOCUS_SCENE")) context.use_scene(scene);
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  return static_cast<int>(locus::cli::run_line(arguments, context));
}
