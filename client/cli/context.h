// State shared by all commands: output streams, global options, and the connection, which is opened on first use and
// then reused. Commands use no globals, so that one process can run many lines. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_CONTEXT_H_
#define LOCUS_CLIENT_CLI_CONTEXT_H_

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/connection_options.h"
#include "client/cli/output.h"
#include "client/lib/client.h"
#include "core/base/progress_line.h"

namespace locus::cli {

// Options that every command accepts.
struct GlobalOptions {
  ConnectionOptions connection;
  std::optional<double> timeout_seconds;  // none = the library's defaults, which are longer for uploads
  Format format = Format::kTable;
  ProgressChoice progress = ProgressChoice::kAuto;
  bool quiet = false;  // no progress, no acknowledgements in tables, no hints
};

using Progress = ProgressStyle;

// Receives a batch of queries that a line would send, and the lines of the input from which it was made.
using BatchSink = std::function<absl::Status(v1::QueryBatch batch, const std::string& input_lines)>;

// Source of lines. The lines that run through a context come from the program's own command line, from a script, or
// from the check of a script before the script runs. During the check every line is parsed, but nothing is sent. A
// script does not choose its connection; the options before `run` on the program's command line choose it.
enum class Lines { kProgram, kScript, kScriptCheck };

class Context {
 public:
  // Borrows the streams. `automatic` is the style of progress that the choice `auto` means: kLive if `err` is a
  // terminal, else kSilent.
  Context(std::ostream& out, std::ostream& err, Progress automatic) : out_(&out), err_(err), automatic_(automatic) {}

  GlobalOptions& options() { return options_; }
  std::ostream& out() { return *out_; }
  // Makes out() return `out`, which is borrowed, and returns the previous stream. For scripts, which read answers.
  std::ostream& redirect_out(std::ostream& out) { return *std::exchange(out_, &out); }
  std::ostream& err() { return err_; }
  // Returns the style in which commands write their progress to err().
  Progress progress() const {
    if (options_.quiet) return Progress::kSilent;
    return progress_style(options_.progress, automatic_ == Progress::kLive);
  }
  Format format() const { return options_.format; }

  // Returns the address of the server. Must be called after the line was parsed, since the line, the environment or a
  // named context can set the address.
  const std::string& address() const { return options_.connection.address; }

  // Returns the connection to address(); the first call opens it. Errors: UNAVAILABLE, with advice, if no server
  // answers; CANCELLED if lines are only checked.
  absl::StatusOr<client::Client*> connect();

  // Cancels the calls that the connection has in progress. Any thread may call this function.
  void cancel_calls();

  // Opens a further connection to address(), for commands that measure with several. Errors as those of connect().
  absl::StatusOr<std::unique_ptr<client::Client>> open_connection() const { return open_connection(address()); }
  // Opens a connection to another server, with the same credentials and timeouts. Errors as those of connect().
  absl::StatusOr<std::unique_ptr<client::Client>> open_connection(const std::string& address) const;

  // Writes `report` to out() in the format of options().
  void write(const Report& report);
  // Writes the report of a change that was made. In the format kTable, writes only the line `text`, or nothing with
  // --quiet.
  void acknowledge(const Report& report, const std::string& text);

  // Returns the scene used by lines that name no scene. If the default scene is empty, every line must name its scene.
  const std::string& default_scene() const { return default_scene_; }
  void use_scene(std::string scene) { default_scene_ = std::move(scene); }

  // Returns the revision of the last acknowledged change that was made to `scene` through this context, or nullopt
  // before the first such change. Queries without --at-least and --exactly require at least this revision, so that they
  // see the changes of earlier lines.
  std::optional<client::Revision> own(const std::string& scene) const;
  void remember_own(const std::string& scene, client::Revision revision) { own_[scene] = revision; }
  void forget_own(const std::string& scene) { own_.erase(scene); }

  // Returns the path of the file of named contexts; empty = there is none.
  const std::string& contexts_path() const { return contexts_path_; }
  void set_contexts_path(std::string path) { contexts_path_ = std::move(path); }
  // Stores the result of reading the named context. If the result is an error, connect() returns this error; commands
  // that do not connect still work.
  void set_connection_mistake(absl::Status mistake) { connection_mistake_ = std::move(mistake); }
  const absl::Status& connection_mistake() const { return connection_mistake_; }

  // Returns the receiver of the batches of bulk queries, or null if they are sent to the server.
  const BatchSink& batch_sink() const { return batch_sink_; }
  void set_batch_sink(BatchSink sink) { batch_sink_ = std::move(sink); }

  Lines lines() const { return lines_; }
  void set_lines(Lines lines) { lines_ = lines; }

  // Stores the result of the command that ran, for outcome().
  void finish(absl::Status outcome) { outcome_ = std::move(outcome); }
  const absl::Status& outcome() const { return outcome_; }

 private:
  std::ostream* out_;
  std::ostream& err_;
  const Progress automatic_;
  GlobalOptions options_;
  std::string contexts_path_;
  absl::Status connection_mistake_;
  std::unique_ptr<client::Client> client_;
  std::atomic<client::Client*> connected_ = nullptr;  // client_, for cancel_calls()
  absl::Status outcome_;
  std::string default_scene_;
  BatchSink batch_sink_;
  std::map<std::string, client::Revision> own_;
  Lines lines_ = Lines::kProgram;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CONTEXT_H_
