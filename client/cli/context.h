// State shared by all commands: output streams, global options, and the connection, which is opened on first use and
// kept. Commands use no globals, so that one process can run many lines. Not thread-safe.
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

// Options that every command accepts.
struct GlobalOptions {
  std::string address = client::kDefaultAddress;
  std::optional<double> timeout_seconds;  // none = the library's defaults, which give uploads more time
  Format format = Format::kTable;
};

// Choice whether to write progress lines, which overwrite themselves, to `err`.
enum class Progress { kSilent, kLive };

// Source of the lines that run through a context. A script has one connection, chosen before it starts. While a script
// is checked, its commands are parsed and nothing is sent.
enum class Lines { kProgram, kScript, kScriptCheck };

class Context {
 public:
  // Borrows the streams.
  Context(std::ostream& out, std::ostream& err, Progress progress) : out_(out), err_(err), progress_(progress) {}

  GlobalOptions& options() { return options_; }
  std::ostream& out() { return out_; }
  std::ostream& err() { return err_; }
  Progress progress() const { return progress_; }

  // Returns the connection to options().address, and connects on the first call. Errors: UNAVAILABLE, with a message
  // for people, if no server answers; a usage error while a batch is open, since no other request may be sent then;
  // CANCELLED if lines are only checked.
  absl::StatusOr<client::Client*> connect();

  // Writes to the output in the chosen format.
  void write(const Report& report);

  // Makes write() keep a copy of each report for take_report(), for scripts that use its values.
  void keep_reports() { keeps_reports_ = true; }
  bool keeps_reports() const { return keeps_reports_; }
  // Returns the last report written since the previous call, once; null if there was none.
  std::shared_ptr<const Report> take_report() { return std::move(kept_); }

  // Returns the scene of lines that name none. Empty: every line must name one.
  const std::string& default_scene() const { return default_scene_; }
  void use_scene(std::string scene) { default_scene_ = std::move(scene); }

  // Returns the revision of the last acknowledged change to `scene` made through this context; none before the first.
  // Queries without a view of their own ask for at least this revision, so that they see the changes of earlier lines.
  std::optional<client::Revision> own(const std::string& scene) const;
  void remember_own(const std::string& scene, client::Revision revision) { own_[scene] = revision; }
  void forget_own(const std::string& scene) { own_.erase(scene); }

  Lines lines() const { return lines_; }
  void set_lines(Lines lines) { lines_ = lines; }

  // Returns the batch that `begin` opened, if any: update commands add to it instead of sending their own batch.
  std::optional<PendingBatch>& pending_batch() { return pending_batch_; }

  // Sets the outcome of the command that ran.
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
