#include "client/cli/script/runner.h"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <utility>

#include "CLI/CLI.hpp"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/failure.h"
#include "client/cli/run.h"
#include "client/cli/script/words.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct Line {
  size_t number;
  std::vector<std::string> words;
};

// Reads a whole script. Stops when more than kMaxScriptBytes are read, which is enough to refuse it.
absl::StatusOr<std::string> read_all(std::istream& in, const std::string& name) {
  std::string text;
  std::vector<char> part(size_t{1} << 16);
  while (text.size() <= kMaxScriptBytes && in) {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part.data(), static_cast<size_t>(in.gcount()));
  }
  if (in.bad()) return absl::FailedPreconditionError(absl::StrCat("cannot read ", name));
  if (text.size() > kMaxScriptBytes)
    return usage_error(absl::StrCat(name, " is larger than the limit of scripts, ", kMaxScriptBytes, " bytes"));
  return text;
}

absl::StatusOr<std::vector<Line>> lines_of(const Script& script) {
  std::vector<Line> lines;
  size_t number = 0;
  for (const absl::string_view text : absl::StrSplit(script.text, '\n')) {
    absl::StatusOr<std::vector<std::string>> words = split_words(text);
    ++number;
    if (!words.ok()) return with_place(words.status(), absl::StrCat(script.name, ":", number));
    if (!words->empty()) lines.push_back({number, *std::move(words)});
  }
  return lines;
}

// Returns the text that Lua compiles: without a byte order mark, and with a first line `#!...` as a comment.
std::string lua_text(absl::string_view text) {
  absl::ConsumePrefix(&text, "\xEF\xBB\xBF");
  return absl::StrCat(absl::StartsWith(text, "#!") ? "--" : "", text);
}

// Settings of a script, by name.
using Settings = std::vector<std::pair<std::string, std::string>>;

// Sets the global table `args`. A function of Lua, since values may be larger than the limit of memory.
int set_args(lua_State* state) {
  lua_newtable(state);
  for (const auto& [name, value] : *static_cast<const Settings*>(lua_touserdata(state, 1))) {
    lua_pushlstring(state, value.data(), value.size());
    lua_setfield(state, -2, name.c_str());
  }
  lua_setglobal(state, "args");
  return 0;
}

absl::StatusOr<ScriptLanguage> language_of(const Script& script, Context& context) {
  if (absl::EndsWith(script.name, ".lua")) return ScriptLanguage::kLua;
  if (absl::EndsWith(script.name, ".locus")) return ScriptLanguage::kLines;
  Sandbox sandbox({});
  if (sandbox.load(script.name, lua_text(script.text)).ok()) return ScriptLanguage::kLua;
  const absl::StatusOr<std::vector<Line>> lines = lines_of(script);
  const bool is_plain = lines.ok() && !lines->empty() && is_command(lines->front().words.front(), context);
  return is_plain ? ScriptLanguage::kLines : ScriptLanguage::kLua;
}

// Runs `lines` in the mode `mode` of the context.
absl::Status run_in_mode(const std::vector<Line>& lines, const Script& script, AfterFailure after, Lines mode,
                         Context& context, LineCounts& counts) {
  const Lines before = context.lines();
  context.set_lines(mode);
  absl::Status ended;
  for (const Line& line : lines) {
    ++counts.run;
    const absl::Status status = run_script_line(line.words, context);
    if (status.ok()) continue;
    const absl::Status placed = with_place(status, absl::StrCat(script.name, ":", line.number));
    ended = placed;
    if (mode == Lines::kScriptCheck) break;
    ++counts.failed;
    write_failure(context.err(), context.options().format, placed);
    ended = reported(placed);
    if (after == AfterFailure::kStop || exit_code_of(status) == ExitCode::kUnreachable) break;
    ended = reported(absl::FailedPreconditionError(absl::StrCat(counts.failed, " lines failed")));
  }
  context.set_lines(before);
  return ended;
}

}  // namespace

bool is_command(const std::string& word, Context& context) {
  CLI::App app;
  build_cli(app, context);
  if (absl::StartsWith(word, "-")) return app.get_option_no_throw(word) != nullptr;
  const std::vector<CLI::App*> commands = app.get_subcommands({});
  return std::any_of(commands.begin(), commands.end(),
                     [&](const CLI::App* command) { return command->check_name(word); });
}

absl::StatusOr<Script> read_script(const std::string& file, Context& context) {
  const bool from_pipe = file == "-";
  std::ifstream opened;
  if (!from_pipe) opened.open(file, std::ios::binary);
  if (!from_pipe && !opened) return absl::NotFoundError(absl::StrCat("cannot open ", file, ": is there such a file?"));
  Script script;
  script.name = from_pipe ? "stdin" : file;
  ASSIGN_OR_RETURN(script.text, read_all(from_pipe ? std::cin : opened, script.name));
  ASSIGN_OR_RETURN(script.language, language_of(script, context));
  return script;
}

absl::Status run_lines(const Script& script, AfterFailure after, bool check_only, Context& context,
                       LineCounts& counts) {
  ASSIGN_OR_RETURN(const std::vector<Line> lines, lines_of(script));
  RETURN_IF_ERROR(run_in_mode(lines, script, after, Lines::kScriptCheck, context, counts));
  if (check_only) return absl::OkStatus();
  counts = {};
  return run_in_mode(lines, script, after, Lines::kScript, context, counts);
}

absl::Status run_lua(const Script& script, const std::vector<std::pair<std::string, std::string>>& settings,
                     const ScriptLimits& limits, AfterFailure after, bool check_only, Context& context,
                     ScriptCounts& counts) {
  Sandbox sandbox(limits);
  ScriptModule module(sandbox, context, after);
  lua_State* const state = sandbox.state();
  lua_pushcfunction(state, set_args);
  lua_pushlightuserdata(state, const_cast<Settings*>(&settings));
  RETURN_IF_ERROR(sandbox.call(1, 0));
  RETURN_IF_ERROR(sandbox.load(absl::StrCat("@", script.name), lua_text(script.text)));
  if (check_only) return absl::OkStatus();
  const Lines before = context.lines();
  context.set_lines(Lines::kScript);
  const absl::Status status = sandbox.call(0, 0);
  context.set_lines(before);
  counts = module.counts();
  RETURN_IF_ERROR(status);
  if (counts.failed == 0) return absl::OkStatus();
  return reported(absl::FailedPreconditionError(absl::StrCat(counts.failed, " expectations failed")));
}

}  // namespace locus::cli
