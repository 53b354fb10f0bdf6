// Creates the writer of a command's progress. Every command that can take long shows its progress through it. A
// function without state.
#ifndef LOCUS_CLIENT_CLI_PROGRESS_H_
#define LOCUS_CLIENT_CLI_PROGRESS_H_

#include "client/cli/context.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

// Returns a writer that writes to context.err() in the style of Context::progress(). Borrows the context. Before a
// command writes anything else, it calls ProgressWriter::hide().
ProgressWriter start_progress(Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_PROGRESS_H_
