#include "client/cli/run.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/connection_options.h"
#include "client/cli/default_scene.h"
#include "client/cli/mistakes.h"

namespace locus::cli {
namespace {

constexpr char kExamples[] = R"(Examples:
  locus scene create arena
  locus import level.glb --scene arena
  locus generate city --triangles 100000 --seed 1 --scene arena --create
  locus insert arena ball --id 7 --at 1,2,3 --radius 0.5
  locus query ray arena --from 0,1,0 --dir 0,0,-1
  locus -o json query ball arena --at 0,0,0 --radius 10
  locus -o csv query ray arena --from-csv rays.csv > hits.csv
  generator | locus move arena --from-ndjson -
  locus export arena arena.glb
  locus backup arena-backup
  locus -a unix:/run/locus.sock health
  locus top
  locus bench --connections 4

Exit codes: 0 ok, 1 failed, 2 usage, 3 unreachable, 4 denied, 5 not found.
LOCUS_SCENE names the scene of commands that are given none. `locus context` keeps addresses and credentials by name.
`locus COMMAND --help` shows a command's options and examples. `source <(locus completion bash)` lets the shell complete
lines of locus; zsh and fish have theirs.)";

// Result of a line that the parser did not run: a help text (code 0) or a parser error.
struct Refusal {
  int code = 0;
  std::string out;
  std::string err;
  std::string hint;
  std::string message;           // the message alone, without the advice that `err` also has
  bool lacks_something = false;  // a required option or argument is missing
};

// Parses one line and runs its command. Returns nullopt if the command ran. CLI11 expects the arguments in reverse
// order and reports errors by exceptions, which are caught here.
std::optional<Refusal> parse_and_run(CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    std::ostringstream out;
    std::ostringstream err;
    const int code = app.exit(error, out, err);
    const Mistake mistake = code == 0 ? Mistake() : mistake_in(app, arguments, error);
    return Refusal{.code = code,
                   .out = out.str(),
                   .err = absl::StrCat("error: ", mistake.message, "\n"),
                   .hint = absl::StrCat("hint: `", mistake.command, " --help` shows commands, options and examples\n"),
                   .message = mistake.message,
                   .lacks_something = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr};
  }
  return std::nullopt;
}

// Parses and runs a line. If a required argument is missing, retries with the default scene inserted. This is safe
// because CLI11 checks required arguments before it runs a command, so the first attempt had no effect.
std::optional<Refusal> run_with_default_scene(const std::vector<std::string>& arguments, Context& context) {
  CLI::App app;
  build_cli(app, context);
  const std::optional<Refusal> refusal = parse_and_run(app, arguments);
  if (!refusal || !refusal->lacks_something) return refusal;
  // Options such as `import --scene` are required only if there is no default scene when the parser is built. So if the
  // default scene comes from the context, which the first attempt has read, the same line is parsed again.
  const bool from_context = context.default_scene().empty();
  if (from_context) context.use_scene(scene_from_context(app, context.contexts_path(), context.options().connection));
  if (context.default_scene().empty()) return refusal;
  const std::optional<std::vector<std::string>> longer = with_scene(app, arguments, context.default_scene());
  if (!longer && !from_context) return refusal;
  CLI::App second;
  build_cli(second, context);
  return parse_and_run(second, longer.value_or(arguments));
}

// Makes the parser refuse --timeout and the options of the connection, and ignore their environment variables. Used for
// the lines of a script, because all lines of a script use one connection. The options of this connection stand before
// `run` on the program's command line.
void restrict_to_script(CLI::App& app) {
  std::vector<const char*> names(std::begin(kConnectionOptionNames), std::end(kConnectionOptionNames));
  names.push_back("--timeout");
  for (const char* name : names) {
    app.get_option(name)->envname("")->check([name](const std::string&) {
      return absl::StrCat("a script has one connection: give ", name, " before `run` or `shell`");
    });
  }
}

}  // namespace

void build_cli(CLI::App& app, Context& context) {
  GlobalOptions& options = context.options();
  app.name("locus");
  app.description("The command line of locusd: scenes, moving objects, and exact ray, ball and box queries.");
  app.footer(kExamples);
  app.set_version_flag("--version", absl::StrCat("locus ", LOCUS_VERSION));
  app.require_subcommand(1);
  app.fallthrough();
  add_connection_options(app, options.connection);
  app.add_option("--timeout", options.timeout_seconds,
                 "Seconds for each call [10; 600 for uploads and changes of instances; a day for backups]")
      ->type_name("SECONDS")
      ->check(positive_number());
  const NamedValues<Format> formats = {
      {"table", Format::kTable}, {"json", Format::kJson}, {"ndjson", Format::kNdjson}, {"csv", Format::kCsv}};
  app.add_option("-o,--output", options.format, "How to print: table, json, ndjson, csv [table]")
      ->type_name("FORMAT")
      ->transform(choices(formats));
  app.add_flag("-q,--quiet", options.quiet,
               "No progress, no hints, and in tables no line that only says what was done");
  const NamedValues<ProgressChoice> progress = {
      {"auto", ProgressChoice::kAuto}, {"always", ProgressChoice::kAlways}, {"never", ProgressChoice::kNever}};
  app.add_option("--progress", options.progress,
                 "When to show progress on standard error: auto (on a terminal), always (elsewhere a line a second), "
                 "never [auto]")
      ->envname("LOCUS_PROGRESS")
      ->type_name("WHEN")
      ->transform(choices(progress));
  if (context.lines() != Lines::kProgram) {
    restrict_to_script(app);
  } else {
    app.parse_complete_callback([&app, &context] {
      context.set_connection_mistake(complete_from_context(app, context.contexts_path(), context.options().connection));
      if (context.default_scene().empty())
        context.use_scene(scene_from_context(app, context.contexts_path(), context.options().connection));
    });
    add_run_command(app, context);
    add_shell_command(app, context);
    add_context_command(app, context);
    add_token_command(app, context);
    add_cert_command(app, context);
  }
  add_scene_command(app, context);
  add_mesh_command(app, context);
  add_instance_command(app, context);
  add_import_command(app, context);
  add_generate_command(app, context);
  add_insert_command(app, context);
  add_move_command(app, context);
  add_remove_command(app, context);
  add_query_command(app, context);
  add_get_command(app, context);
  add_render_command(app, context);
  add_dump_command(app, context);
  add_export_command(app, context);
  add_backup_command(app, context);
  add_restore_command(app, context);
  add_demo_command(app, context);
  add_bench_command(app, context);
  add_top_command(app, context);
  add_cluster_command(app, context);
  add_limits_command(app, context);
  add_quota_command(app, context);
  add_health_command(app, context);
  add_call_command(app, context);
  add_version_command(app, context);
  add_completion_command(app, context);
  add_tune_command(app, context);
  add_verify_command(app, context);
  add_wait_command(app, context);
}

ExitCode run_line(const std::vector<std::string>& arguments, Context& context) {
  context.finish(absl::OkStatus());
  if (const std::optional<Refusal> refusal = run_with_default_scene(arguments, context)) {
    context.out() << refusal->out;
    if (refusal->code != 0) context.err() << refusal->err;
    // The parser sets no options if it refuses a line.
    const bool quiet = std::any_of(arguments.begin(), arguments.end(),
                                   [](const std::string& word) { return word == "-q" || word == "--quiet"; });
    if (refusal->code != 0 && !quiet) context.err() << refusal->hint;
    return refusal->code == 0 ? ExitCode::kOk : ExitCode::kUsage;
  }
  if (!context.outcome().ok() && !is_reported(context.outcome()))
    write_failure(context.err(), context.format(), context.outcome(),
                  context.options().quiet ? Hints::kHidden : Hints::kShown);
  return exit_code_of(context.outcome());
}

absl::Status run_script_line(const std::vector<std::string>& arguments, Context& context) {
  const GlobalOptions before = context.options();
  context.finish(absl::OkStatus());
  const std::optional<Refusal> refusal = run_with_default_scene(arguments, context);
  context.options() = before;
  if (!refusal) return context.outcome();
  if (refusal->code != 0) return usage_error(refusal->message);
  if (context.lines() == Lines::kScript) context.out() << refusal->out;
  return absl::OkStatus();
}

}  // namespace locus::cli
