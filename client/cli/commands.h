// The commands, one function each: it adds the command's options, help and examples to `parent`, and a callback that
// runs the command through `context` once the line is parsed. `context` must outlive the parser.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_H_

#include "CLI/CLI.hpp"
#include "client/cli/context.h"
#include "client/cli/failure.h"

namespace locus::cli {

void add_scene_command(CLI::App& parent, Context& context);
void add_mesh_command(CLI::App& parent, Context& context);
void add_import_command(CLI::App& parent, Context& context);
void add_generate_command(CLI::App& parent, Context& context);
void add_insert_command(CLI::App& parent, Context& context);
void add_move_command(CLI::App& parent, Context& context);
void add_remove_command(CLI::App& parent, Context& context);
void add_query_command(CLI::App& parent, Context& context);
void add_get_command(CLI::App& parent, Context& context);
void add_render_command(CLI::App& parent, Context& context);
void add_dump_command(CLI::App& parent, Context& context);
void add_export_command(CLI::App& parent, Context& context);
void add_backup_command(CLI::App& parent, Context& context);
void add_restore_command(CLI::App& parent, Context& context);
void add_demo_command(CLI::App& parent, Context& context);
void add_run_command(CLI::App& parent, Context& context);
void add_wait_command(CLI::App& parent, Context& context);
void add_top_command(CLI::App& parent, Context& context);
void add_limits_command(CLI::App& parent, Context& context);
void add_health_command(CLI::App& parent, Context& context);
void add_version_command(CLI::App& parent, Context& context);
void add_completion_command(CLI::App& parent, Context& context);

// Runs `run(options, context)`, which returns an absl::Status, if `command` was chosen. Does nothing if lines are only
// checked (Lines::kScriptCheck).
template <class Options, class Run>
void run_when_chosen(CLI::App& command, std::shared_ptr<Options> options, Context& context, Run run) {
  command.callback([options, &context, run] {
    if (context.lines() != Lines::kScriptCheck) context.finish(run(*options, context));
  });
}

// Like run_when_chosen(), for a command without side effects before Context::connect(). If lines are only checked, the
// command runs up to connect(), which fails, so that options that exclude each other are reported.
template <class Options, class Run>
void run_or_check_when_chosen(CLI::App& command, std::shared_ptr<Options> options, Context& context, Run run) {
  command.callback([options, &context, run] {
    const absl::Status outcome = run(*options, context);
    const bool checked = context.lines() == Lines::kScriptCheck && exit_code_of(outcome) != ExitCode::kUsage;
    context.finish(checked ? absl::OkStatus() : outcome);
  });
}

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_H_
