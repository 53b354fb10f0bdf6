// `locus run`: a script in Lua, or lines of `locus`.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/script/runner.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr char kReference[] =
    R"(FILE is a script in Lua 5.4 with the module `locus` (FILE.lua), or has one command of `locus` without the word on
each line (FILE.locus). Another file, and standard input, may have either.

The module in short; client/cli/script/README.md has all of it:
  local arena = locus.scene("arena")            a scene; arena:create(), arena:delete{if_present=true}
  local updates = arena:updates()               a batch by row
  updates:insert{id=7, at={0,0,30}, ball=0.5}:move{id=8, at={1,0,0}}:commit{tick=1}
  local hits = arena:queries():ray{from={0,0,99}, dir={0,0,-1}}:run()
  locus.expect_near(hits[1].t, 68.5, 1e-5)      also expect, expect_equal, expect_error
  local near = locus.command("query ball arena --at 0,0,0 --radius 5")   any command; near.rows[1].id
  locus.print(near)                             in the format of -o
Queries see the changes that the script has made. --set NAME=VALUE sets args.NAME.
Exit codes: 1 an expectation failed or the script raised an error, 2 it does not compile, else that of the command.

Examples:
  locus run first_steps.lua
  locus -a 127.0.0.1:7575 run game_tick.lua --set players=64 --keep-going
  echo 'scene list' | locus run -
  locus run arena.locus --dry-run)";

struct RunOptions {
  std::string file;
  std::vector<std::string> settings;
  bool keep_going = false;
  bool dry_run = false;
  uint64_t max_memory_mib = ScriptLimits().memory_bytes >> 20;
  double max_seconds = absl::ToDoubleSeconds(ScriptLimits().time);
  ScriptLimits limits;
};

absl::StatusOr<std::vector<std::pair<std::string, std::string>>> read_settings(
    const std::vector<std::string>& settings) {
  std::vector<std::pair<std::string, std::string>> values;
  for (const std::string& setting : settings) {
    const size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      return usage_error(absl::StrCat("--set ", setting, " is not of the form NAME=VALUE"));
    values.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
  }
  return values;
}

// Writes the end of a script on one line of the error stream: a text, or JSON if the output is not a table.
void write_end(const Json& facts, const std::string& text, Context& context) {
  context.err() << (context.options().format == Format::kTable ? text : json_line(facts)) << '\n';
}

absl::Status run_as_lines(const Script& script, const RunOptions& options, AfterFailure after, Context& context) {
  if (!options.settings.empty()) return usage_error("--set is for scripts in Lua");
  LineCounts counts;
  const absl::Status outcome = run_lines(script, after, options.dry_run, context, counts);
  Json facts = {{"script", script.name}, {options.dry_run ? "checked" : "lines", counts.run}};
  if (!options.dry_run) facts["failed"] = counts.failed;
  const std::string end =
      options.dry_run ? " lines checked, no mistake found" : absl::StrCat(" lines run, ", counts.failed, " failed");
  if (outcome.ok() || is_reported(outcome)) write_end(facts, absl::StrCat(script.name, ": ", counts.run, end), context);
  return outcome;
}

absl::Status run_as_lua(const Script& script, const RunOptions& options, AfterFailure after, Context& context) {
  ASSIGN_OR_RETURN(const auto settings, read_settings(options.settings));
  ScriptLimits limits = options.limits;
  limits.memory_bytes = options.max_memory_mib << 20;
  limits.time = absl::Seconds(options.max_seconds);
  ScriptCounts counts;
  const absl::Status outcome = run_lua(script, settings, limits, after, options.dry_run, context, counts);
  if (options.dry_run) {
    RETURN_IF_ERROR(outcome);
    write_end({{"script", script.name}, {"checked", true}}, absl::StrCat(script.name, ": compiled, no mistake found"),
              context);
    return outcome;
  }
  if (!outcome.ok() && !is_reported(outcome)) write_failure(context.err(), context.options().format, outcome);
  if (counts.passed + counts.failed > 0)
    write_end({{"script", script.name}, {"passed", counts.passed}, {"failed", counts.failed}},
              absl::StrCat(script.name, ": ", counts.passed, " expectations passed, ", counts.failed, " failed"),
              context);
  return outcome.ok() ? outcome : reported(outcome);
}

absl::Status run(const RunOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const Script script, read_script(options.file, context));
  const AfterFailure after = options.keep_going ? AfterFailure::kGoOn : AfterFailure::kStop;
  return script.language == ScriptLanguage::kLua ? run_as_lua(script, options, after, context)
                                                 : run_as_lines(script, options, after, context);
}

}  // namespace

void add_run_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App& command = *parent.add_subcommand("run", "Run a script in Lua, or lines of locus");
  command.footer(kReference);
  command.add_option("FILE", options->file, "The script; - reads it from standard input")->required();
  command.add_option("--set", options->settings, "A field of the script's table args; repeat for more")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command.add_flag("--keep-going", options->keep_going,
                   "Continue after expectations and lines that fail; print and count their errors");
  command.add_flag("--dry-run", options->dry_run, "Only compile the script or check the lines; needs no server");
  command
      .add_option("--max-instructions", options->limits.instructions,
                  "Instructions of Lua after which the script ends; 0 = no limit [2000000000]")
      ->type_name("N");
  command.add_option("--max-memory", options->max_memory_mib, "Memory of Lua in MiB; 0 = no limit [256]")
      ->type_name("MIB")
      ->check(CLI::Range(uint64_t{0}, uint64_t{1} << 20));
  command.add_option("--max-seconds", options->max_seconds, "Seconds after which the script ends; 0 = no limit [3600]")
      ->type_name("SECONDS")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--unsafe", options->limits.unsafe,
                   "Also offer os.execute, os.exit, io.popen, debug, finalizers and modules in C");
  run_when_chosen(command, options, context, run);
}

}  // namespace locus::cli
