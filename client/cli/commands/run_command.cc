// `locus run`: a script of command lines, with variables, batches, loops and expectations.
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/script/runner.h"
#include "client/cli/script/script.h"
#include "client/cli/script/script_limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr char kReference[] = R"(Lines of a script (one statement each, quotes as in a shell, # begins a comment):
  query ray --from 0,0,9 --dir 0,0,-1 -> shot   any line of locus without the word; -> keeps its result
  use arena                                     the scene of lines that name none
  let aim = $shot.point + (0, 0, 1)             a number, a vector or a text
  begin --tick 7 ... commit -> ack              insert, move, remove lines as one batch, one revision
  repeat 10 as i ... end                        i counts from 0
  expect $shot.t == 8.5 within 0.001            also != < <= > >= contains
  expect-error UNKNOWN_ID move --id 9 --to 0,0,0
  wait, echo TEXT, sleep SECONDS
Values in lines:
  $shot.revision, $shot.id[0]                   a fact of a result; a row of a column, one row needs no [0]
  $near.count, ${name:-other}                   the number of rows; other where there is no value
  {$i * 2 + 1}                                  + - * / % on numbers and vectors, and functions: abs cos cross
                                                dot floor len length max min radians round sin sqrt unit
Queries see the script's own last ack. Every line is checked before the first runs.
Exit codes: 1 an expectation failed, 2 a mistake in the script, else that of the line that failed.
Examples:
  locus run first_steps.locus
  locus -a 127.0.0.1:7575 -o ndjson run tick.locus --set players=64 --keep-going
  echo 'scene list' | locus run -
  locus run shots.locus --dry-run)";

struct RunOptions {
  std::string file;
  std::vector<std::string> settings;
  bool keep_going = false;
  bool dry_run = false;
};

// Reads a whole script. Stops when more than kMaxScriptBytes are read, which is enough for the caller to detect and
// refuse a script that is too long.
absl::StatusOr<std::string> read_all(std::istream& in, const std::string& name) {
  std::string text;
  std::vector<char> part(size_t{1} << 16);
  while (text.size() <= kMaxScriptBytes && in) {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part.data(), static_cast<size_t>(in.gcount()));
  }
  if (in.bad()) return absl::FailedPreconditionError(absl::StrCat("cannot read ", name));
  return text;
}

absl::StatusOr<Script> read_script(const std::string& file) {
  const bool from_pipe = file == "-";
  std::ifstream opened;
  if (!from_pipe) opened.open(file, std::ios::binary);
  if (!from_pipe && !opened) return absl::NotFoundError(absl::StrCat("cannot open ", file, ": is there such a file?"));
  const absl::StatusOr<std::string> text = read_all(from_pipe ? std::cin : opened, file);
  return text.ok() ? parse_script(from_pipe ? "stdin" : file, *text) : text.status();
}

absl::StatusOr<Variables> variables_from(const std::vector<std::string>& settings) {
  Variables variables;
  for (const std::string& setting : settings) {
    const size_t equals = setting.find('=');
    if (equals == std::string::npos)
      return usage_error(absl::StrCat("--set ", setting, " is not of the form NAME=VALUE"));
    const absl::Status set = variables.set(setting.substr(0, equals), Value::of(Json(setting.substr(equals + 1))));
    if (!set.ok()) return usage_error(absl::StrCat("--set ", setting, ": ", set.message()));
  }
  return variables;
}

void write_checked(const Script& script, const ScriptCounts& counts, Context& context) {
  if (context.options().format == Format::kTable) {
    context.err() << script.name << ": " << counts.lines << " lines checked, no mistake found\n";
    return;
  }
  Report report;
  report.head = {{"script", script.name}, {"checked", counts.lines}};
  write_report(context.err(), Format::kNdjson, report);
}

void write_end(const Script& script, const ScriptCounts& counts, Context& context) {
  if (context.options().format != Format::kTable) {
    Report report;
    report.head = {{"script", script.name},
                   {"lines", counts.lines},
                   {"passed", counts.passed},
                   {"failed", counts.failed},
                   {"broken", counts.broken}};
    write_report(context.err(), Format::kNdjson, report);
    return;
  }
  context.err() << script.name << ": " << counts.lines << " lines run, " << counts.passed << " expectations passed, "
                << counts.failed << " failed";
  if (counts.broken > 0) context.err() << ", " << counts.broken << " other lines failed";
  context.err() << '\n';
}

absl::Status run(const RunOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const Variables variables, variables_from(options.settings));
  ASSIGN_OR_RETURN(const Script script, read_script(options.file));
  ScriptCounts checked;
  RETURN_IF_ERROR(check_script(script, variables, context, checked));
  if (options.dry_run) {
    write_checked(script, checked, context);
    return absl::OkStatus();
  }
  ScriptCounts counts;
  const AfterFailure after = options.keep_going ? AfterFailure::kGoOn : AfterFailure::kStop;
  const absl::Status outcome = run_script(script, variables, after, context, counts);
  write_end(script, counts, context);
  return outcome;
}

}  // namespace

void add_run_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App& command = *parent.add_subcommand("run", "Run a script of command lines with expectations");
  command.footer(kReference);
  command.add_option("FILE", options->file, "The script; - reads it from standard input")->required();
  command.add_option("--set", options->settings, "A variable for the script; repeat for more")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command.add_flag("--keep-going", options->keep_going, "Continue after lines that fail; print and count their errors");
  command.add_flag("--dry-run", options->dry_run, "Only check every line; needs no server");
  run_when_chosen(command, options, context, run);
}

}  // namespace locus::cli
