#include "client/cli/shell/shell.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/command_words.h"
#include "client/cli/extras/completion/table.h"
#include "client/cli/failure.h"
#include "client/cli/run.h"
#include "client/cli/script/module.h"
#include "client/cli/script/sandbox.h"
#include "client/cli/script/words.h"
#include "client/cli/shell/completer.h"
#include "client/cli/shell/input.h"
#include "client/cli/shell/interrupt_watch.h"
#include "client/cli/shell/line_reader.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr char kPrompt[] = "locus> ";
constexpr char kMorePrompt[] = "   ...> ";
constexpr char kChunk[] = "=input";

constexpr char kHelp[] = R"(Commands without the word locus, such as
  scene list
  query ray arena --from 0,0,9 --dir 0,0,-1
and Lua with the module locus, such as
  arena = locus.scene("arena")
  arena:queries():ray{from={0,0,9}, dir={0,0,-1}}:run()[1].t
use SCENE: commands that name no scene use SCENE. help COMMAND: the help of a command. Tab completes a word, Ctrl-C ends
a command, Ctrl-D or exit ends the shell.
)";

std::vector<TableEntry> table_of(Context& context) {
  CLI::App app;
  build_cli(app, context);
  return completion_table(words_of(app));
}

class Shell {
 public:
  Shell(const ScriptLimits& limits, Context& context)
      : context_(context),
        interrupts_(std::make_unique<InterruptWatch>([this] { interrupt(); })),
        table_(table_of(context)),
        sandbox_(limits),
        module_(sandbox_, context, AfterFailure::kStop) {
    const bool on_terminal = isatty(STDIN_FILENO) != 0 && isatty(STDOUT_FILENO) != 0;
    const std::string& contexts = context.contexts_path();
    const std::string history = contexts.empty() ? "" : contexts.substr(0, contexts.rfind('/') + 1) + "history";
    reader_ = on_terminal
                  ? LineReader::of_terminal(
                        history, [this](absl::string_view line) { return complete(table_, line, scene_names()); })
                  : LineReader::of_stream(std::cin);
    if (on_terminal)
      context.out() << "locus " << LOCUS_VERSION << ", server " << context.address() << "; `help` explains the shell\n";
  }

  ~Shell() { interrupts_ = nullptr; }
  Shell(const Shell&) = delete;
  Shell& operator=(const Shell&) = delete;

  void run() {
    std::string input;
    while (true) {
      context_.out() << std::flush;
      const LineEnd end = reader_->read(kPrompt, input);
      if (end == LineEnd::kEnded) break;
      if (end == LineEnd::kDropped) continue;
      input = without_program(input, table_);
      const InputKind kind = kind_of_input(input, table_);
      if (kind == InputKind::kEnd) break;
      absl::Status status = run_input(kind, input);
      if (absl::IsCancelled(status)) status = absl::CancelledError("interrupted");
      reader_->remember(input);
      if (!status.ok() && !is_reported(status)) write_failure(context_.err(), context_.options().format, status);
      context_.err() << std::flush;
    }
  }

 private:
  absl::Status run_input(InputKind kind, std::string& input) {
    switch (kind) {
      case InputKind::kNothing:
      case InputKind::kEnd:
        return absl::OkStatus();
      case InputKind::kHelp:
        return run_help(input);
      case InputKind::kUse:
        return use_scene(input);
      case InputKind::kCommand:
        return run_command(input);
      case InputKind::kLua:
        return run_lua(input);
    }
    return absl::OkStatus();
  }

  absl::Status run_words(const std::vector<std::string>& words) {
    const Running running(*this);
    return run_script_line(words, context_);
  }

  absl::Status run_command(const std::string& line) {
    ASSIGN_OR_RETURN(const std::vector<std::string> words, split_words(line));
    return run_words(words);
  }

  absl::Status run_help(const std::string& line) {
    ASSIGN_OR_RETURN(std::vector<std::string> words, split_words(line));
    if (words.size() == 1) {
      context_.out() << kHelp << '\n';
      words = {"help"};
    }
    words.erase(words.begin());
    words.emplace_back("--help");
    return run_words(words);
  }

  absl::Status use_scene(const std::string& line) {
    ASSIGN_OR_RETURN(const std::vector<std::string> words, split_words(line));
    if (words.size() != 2) return usage_error("expected `use SCENE`");
    context_.use_scene(words[1]);
    return absl::OkStatus();
  }

  // Runs Lua: an expression, whose values are printed, or statements, for which more lines are read while they are
  // incomplete.
  absl::Status run_lua(std::string& input) {
    absl::Status loaded = sandbox_.load(kChunk, absl::StrCat("return ", input));
    if (!loaded.ok()) loaded = sandbox_.load(kChunk, input);
    while (Sandbox::is_incomplete(loaded)) {
      std::string line;
      const LineEnd end = reader_->read(kMorePrompt, line);
      if (end == LineEnd::kDropped || (end == LineEnd::kLine && line.empty())) return absl::OkStatus();
      if (end == LineEnd::kEnded) break;
      absl::StrAppend(&input, "\n", line);
      loaded = sandbox_.load(kChunk, input);
    }
    if (const std::string advice = unknown_command(input, table_);
        !advice.empty() && (!loaded.ok() || is_undefined(input))) {
      lua_settop(sandbox_.state(), 0);
      return usage_error(advice);
    }
    RETURN_IF_ERROR(loaded);
    const Running running(*this);
    absl::Status status = sandbox_.call(0, LUA_MULTRET);
    if (status.ok()) status = module_.print_results();
    lua_settop(sandbox_.state(), 0);
    return status;
  }

  // Returns whether `input` is only the name of a global variable that does not exist.
  bool is_undefined(const std::string& input) {
    const std::string name(absl::StripAsciiWhitespace(input));
    const bool is_name =
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return absl::ascii_isalnum(c) || c == '_'; });
    if (!is_name) return false;
    lua_State* const state = sandbox_.state();
    lua_pushglobaltable(state);
    lua_pushlstring(state, name.data(), name.size());
    const bool undefined = lua_rawget(state, -2) == LUA_TNIL;
    lua_pop(state, 2);
    return undefined;
  }

  // While it exists, Ctrl-C ends what runs.
  class Running {
   public:
    explicit Running(Shell& shell) : shell_(shell) { shell_.running_ = ++shell_.runs_; }
    ~Running() { shell_.running_ = 0; }

   private:
    Shell& shell_;
  };

  // Ends what runs. Runs in the thread of interrupts_. Repeats the interrupt until the run has ended, since a call may
  // begin just after the others were cancelled.
  void interrupt() {
    const uint64_t run = running_;
    while (run != 0 && running_ == run) {
      sandbox_.interrupt();
      context_.cancel_calls();
      absl::SleepFor(absl::Milliseconds(20));
    }
  }

  SceneNames scene_names() {
    return [this] {
      std::vector<std::string> names;
      const absl::StatusOr<client::Client*> client = context_.connect();
      if (!client.ok()) return names;
      const absl::StatusOr<std::vector<v1::Scene>> scenes = (*client)->list_scenes();
      if (!scenes.ok()) return names;
      for (const v1::Scene& scene : *scenes) names.push_back(scene.name());
      return names;
    };
  }

  Context& context_;
  uint64_t runs_ = 0;
  std::atomic<uint64_t> running_ = 0;           // number of the command or the Lua that runs; 0 = none
  std::unique_ptr<InterruptWatch> interrupts_;  // ends before the sandbox, which it interrupts
  const std::vector<TableEntry> table_;
  Sandbox sandbox_;
  ScriptModule module_;
  std::unique_ptr<LineReader> reader_;
};

}  // namespace

absl::Status run_shell(const ScriptLimits& limits, Context& context) {
  const Lines before = context.lines();
  context.set_lines(Lines::kScript);
  Shell(limits, context).run();
  context.set_lines(before);
  return absl::OkStatus();
}

}  // namespace locus::cli
