// What every command shares: where to write, how, and the connection, opened when first needed and kept. Commands reach
// nothing global, so that one process can run many lines. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_CONTEXT_H_
#define LOCUS_CLIENT_CLI_CONTEXT_H_

#include <memory>
#include <optional>
#include <ostream>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/output.h"
#include "client/lib/client.h"

namespace locus::cli {

// The options before every command.
struct GlobalOptions {
  std::string address = client::kDefaultAddress;
  std::optional<double> timeout_seconds;  // none = the library's defaults, which give uploads more time
  Format format = Format::kTable;
};

// Whether lines that overwrite themselves make sense on `err`.
enum class Progress { kSilent, kLive };

class Context {
 public:
  // Borrows the streams.
  Context(std::ostream& out, std::ostream& err, Progress progress) : out_(out), err_(err), progress_(progress) {}

  GlobalOptions& options() { return options_; }
  std::ostream& out() { return out_; }
  std::ostream& err() { return err_; }
  Progress progress() const { return progress_; }

  // Connects to options().address the first time. UNAVAILABLE in words for the command line.
  absl::StatusOr<client::Client*> connect();

  // Writes to the output in the chosen format.
  void write(const Report& report) { write_report(out_, options_.format, report); }

  // The outcome of the command that ran.
  void finish(absl::Status outcome) { outcome_ = std::move(outcome); }
  const absl::Status& outcome() const { return outcome_; }

 private:
  std::ostream& out_;
  std::ostream& err_;
  const Progress progress_;
  GlobalOptions options_;
  std::unique_ptr<client::Client> client_;
  absl::Status outcome_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CONTEXT_H_
