#include "client/cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

namespace locus::cli {
namespace {

constexpr size_t kDefaultColumns = 80;

size_t terminal_columns() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kDefaultColumns;
}

}  // namespace

ProgressWriter start_progress(Context& context) {
  return ProgressWriter({.style = context.progress(),
                         .columns = terminal_columns(),
                         .now = [] { return std::chrono::steady_clock::now(); },
                         .write = [&context](absl::string_view text) { context.err() << text << std::flush; }});
}

}  // namespace locus::cli
