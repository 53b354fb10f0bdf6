// Conversions between tables of Lua and messages of the protocol or JSON. Functions for the thread that runs the
// script.
//
// A message is a table with the names of the protocol's fields. A repeated field is a list; lists of numbers may be
// nested, as in positions = {{0, 0, 1}, {0, 0, 2}}, and one value stands for a list of it. An enum is the name of its
// value, with or without the prefix of the enum ("first", "RAY_MODE_FIRST"). 64-bit integers:
// client/cli/script/numbers.h.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_TABLES_H_
#define LOCUS_CLIENT_CLI_SCRIPT_TABLES_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/output.h"
#include "google/protobuf/message.h"
#include "lua.hpp"

namespace locus::cli {

// Reads the table at `index` into the empty `message`. Returns a usage error that names the field if the table does not
// fit: an unknown field (with the most similar one), a value of a wrong type or out of range.
absl::Status read_message(lua_State* state, int index, google::protobuf::Message& message);

// Pushes a table with the fields of `message`. Messages that are not set, and values that are optional and not set, are
// nil; all other fields are present.
void push_message(lua_State* state, const google::protobuf::Message& message);

// Pushes a JSON value. null becomes nil. Texts under the names of 64-bit values of the command line's answers (id,
// group, tag, other, epoch, missing) become numbers.
void push_json(lua_State* state, const Json& value);

// Returns the value at `index` as JSON. A table with a first element is a list, another one an object whose keys are in
// alphabetical order, id first. Functions and the like become their text. Returns a usage error for tables that are
// nested too deeply.
absl::StatusOr<Json> read_json(lua_State* state, int index);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_TABLES_H_
