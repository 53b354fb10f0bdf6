// What every command shares: where to write, how, and the connection, opened when first needed and kept. Commands reach
// nothing global, so that one process can run many lines. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_CONTEXT_H_
#define LOCUS_CLIENT_CLI_CONTEXT_H_

#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/output.h"
#include "client/cli/pending_batch.h"
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

// What the lines are that run through a context. A script has one connection, chosen before it; while it is checked,
// commands are parsed but nothing is sent.
enum class Lines { kProgram, kScript, kScriptCheck };

class Context {
 public:
  // Borrows the streams.
  Context(std::ostream& out, std::ostream& err, Progress progress) : out_(out), err_(err), progress_(progress) {}

  GlobalOptions& options() { return options_; }
  std::ostream& out() { return out_; }
  std::ostream& err() { return err_; }
  Progress progress() const { return progress_; }

  // Connects to options().address the first time. UNAVAILABLE in words for the command line; a usage error while a
  // batch is open, since nothing else is sent meanwhile; CANCELLED where lines are only checked.
  absl::StatusOr<client::Client*> connect();

  // Writes to the output in the chosen format.
  void write(const Report& report);

  // From here on the last report written is kept as well, for whoever works with its values.
  void keep_reports() { keeps_reports_ = true; }
  bool keeps_reports() const { return keeps_reports_; }
  // The last report written since the last call; null if there was none.
  std::shared_ptr<const Report> take_report() { return std::move(kept_); }

  // The scene of lines that name none; empty = every line must.
  const std::string& default_scene() const { return default_scene_; }
  void use_scene(std::string scene) { default_scene_ = std::move(scene); }

  // The latest revision of a scene that a change made through this context was acknowledged under. Queries that ask for
  // no other view ask for at least this one, so that many lines in one process see their own writes.
  std::optional<client::Revision> own(const std::string& scene) const;
  void remember_own(const std::string& scene, client::Revision revision) { own_[scene] = revision; }
  void forget_own(const std::string& scene) { own_.erase(scene); }

  Lines lines() const { return lines_; }
  void set_lines(Lines lines) { lines_ = lines; }

  // The batch that `begin` opened: update commands add to it instead of sending their own.
  std::optional<PendingBatch>& pending_batch() { return pending_batch_; }

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
  bool keeps_reports_ = false;
  std::shared_ptr<const Report> kept_;
  std::string default_scene_;
  std::map<std::string, client::Revision> own_;
  Lines lines_ = Lines::kProgram;
  std::optional<PendingBatch> pending_batch_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CONTEXT_H_
