// Streams of update and query batches as objects of Lua. Functions for the thread that runs the script.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_STREAMS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_STREAMS_H_

#include <memory>

#include "client/lib/client.h"
#include "lua.hpp"

namespace locus::cli {

// Push a stream. Its methods: send(BATCH) sends a batch and returns the number of batches sent, and blocks while too
// many are unanswered; flush() waits for all answers and returns those since the last flush(), in the order sent, an
// error object for a batch that failed; close() flushes and ends the stream. A stream of queries also has step(UPDATE,
// QUERIES), which sends a step; its answer is a table with `ack`, and `result`, an error object if the queries failed.
void push_stream(lua_State* state, std::unique_ptr<client::UpdateStream> stream);
void push_stream(lua_State* state, std::unique_ptr<client::QueryStream> stream);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_STREAMS_H_
