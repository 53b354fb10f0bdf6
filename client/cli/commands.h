// Functions that add the commands to the parser. Each function adds to `parent` a command with its options, help and
// examples, and a callback that runs the command through `context` when a line with this command was parsed. `context`
// must outlive the parser.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_H_

#include "CLI/CLI.hpp"
#include "client/cli/context.h"
#include "client/cli/failure.h"

namespace locus::cli {

void add_scene_command(CLI::App& parent, Context& context);
void add_mesh_command(CLI::App& parent, Context& context);
void add_instance_command(CLI::App& parent, Context& context);
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
void add_call_command(CLI::App& parent, Context& context);
void add_run_command(CLI::App& parent, Context& context);
void add_shell_command(CLI::App& parent, Context& context);
void add_tune_command(CLI::App& parent, Context& context);
void add_verify_command(CLI::App& parent, Context& context);
void add_wait_command(CLI::App& parent, Context& context);
void add_bench_command(CLI::App& parent, Context& context);
void add_top_command(CLI::App& parent, Context& context);
void add_cluster_command(CLI::App& parent, Context& context);
void add_limits_command(CLI::App& parent, Context& context);
void add_quota_command(CLI::App& parent, Context& context);
void add_health_command(CLI::App& parent, Context& context);
void add_version_command(CLI::App& parent, Context& context);
void add_completion_command(CLI::App& parent, Context& context);
void add_context_command(CLI::App& parent, Context& context);
void add_token_command(CLI::App& parent, Context& context);
void add_cert_command(CLI::App& parent, Context& context);

// Sets the callback that CLI11 calls if the parsed line contains `command`. The callback runs `run(options, context)`,
// which returns an absl::Status. While a script is only checked (Lines::kScriptCheck), the callback does nothing.
template <class Options, class Run>
void run_when_chosen(CLI::App& command, std::shared_ptr<Options> options, Context& context, Run run) {
  command.callback([options, &context, run] {
    if (context.lines() != Lines::kScriptCheck) context.finish(run(*options, context));
  });
}

// Sets the callback like run_when_chosen(), for a command that has no side effects before it calls Context::connect().
// While a script is only checked, `run` is called too; connect() then fails, so the call reports only usage errors, for
// example options that exclude each other.
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
