// 64-bit unsigned numbers in Lua: ids, groups, tags, epochs and revisions. Lua's integers are signed, so a number up to
// 2^63-1 is an integer, and a larger one an object that compares, concatenates and prints like a number. Equal numbers
// are the same Lua value, so that both forms work as keys of tables. Functions for the thread that runs the script.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_NUMBERS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_NUMBERS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "lua.hpp"

namespace locus::cli {

// Creates the metatable of large numbers. Must be called once for each Lua state, before the other functions.
void open_numbers(lua_State* state);

void push_unsigned(lua_State* state, uint64_t value);

// Returns the number at `index`: an integer from 0 on, a large number, a float that is such an integer and at most 2^53
// (above, floats skip integers), or a text with a decimal or 0x hexadecimal number. Returns nullopt for other values.
std::optional<uint64_t> to_unsigned(lua_State* state, int index);

// Returns the shortest text from which the same double is read.
std::string text_of_number(double value);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_NUMBERS_H_
