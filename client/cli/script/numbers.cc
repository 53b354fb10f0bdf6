#include "client/cli/script/numbers.h"

#include <charconv>
#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace locus::cli {
namespace {

constexpr char kLargeNumber[] = "locus.id";        // name of the metatable
constexpr double kExactFloats = 9007199254740992;  // 2^53
constexpr uint64_t kMaxInteger = (uint64_t{1} << 63) - 1;
const char kLargeNumbers = 0;  // its address is the registry's key of the table of all large numbers

uint64_t* large_number(lua_State* state, int index) {
  return static_cast<uint64_t*>(luaL_testudata(state, index, kLargeNumber));
}

std::string text_of(lua_State* state, int index) {
  const uint64_t* const number = large_number(state, index);
  if (number != nullptr) return absl::StrCat(*number);
  size_t size = 0;
  const char* const text = luaL_tolstring(state, index, &size);
  std::string copy(text, size);
  lua_pop(state, 1);
  return copy;
}

int to_text(lua_State* state) {
  lua_pushstring(state, text_of(state, 1).c_str());
  return 1;
}

int concatenate(lua_State* state) {
  const std::string both = text_of(state, 1) + text_of(state, 2);
  lua_pushlstring(state, both.data(), both.size());
  return 1;
}

// Returns whether argument 1 is less than argument 2, one of which is a large number.
bool less(lua_State* state) {
  const std::optional<uint64_t> left = to_unsigned(state, 1);
  const std::optional<uint64_t> right = to_unsigned(state, 2);
  if (left && right) return *left < *right;
  return left ? static_cast<double>(*left) < luaL_checknumber(state, 2)
              : luaL_checknumber(state, 1) < static_cast<double>(*large_number(state, 2));
}

int is_less(lua_State* state) {
  lua_pushboolean(state, less(state));
  return 1;
}

int is_less_or_equal(lua_State* state) {
  lua_pushboolean(state, lua_rawequal(state, 1, 2) != 0 || less(state));
  return 1;
}

}  // namespace

void open_numbers(lua_State* state) {
  luaL_newmetatable(state, kLargeNumber);
  const luaL_Reg functions[] = {{"__tostring", to_text},
                                {"__concat", concatenate},
                                {"__lt", is_less},
                                {"__le", is_less_or_equal},
                                {nullptr, nullptr}};
  luaL_setfuncs(state, functions, 0);
  lua_pushliteral(state, "locus.id");
  lua_setfield(state, -2, "__metatable");  // scripts must not replace the functions
  lua_pop(state, 1);
  lua_newtable(state);
  lua_newtable(state);
  lua_pushliteral(state, "v");  // weak values: a large number that is not used is collected
  lua_setfield(state, -2, "__mode");
  lua_setmetatable(state, -2);
  lua_rawsetp(state, LUA_REGISTRYINDEX, &kLargeNumbers);
}

void push_unsigned(lua_State* state, uint64_t value) {
  const auto bits = static_cast<lua_Integer>(value);
  if (value <= kMaxInteger) {
    lua_pushinteger(state, bits);
    return;
  }
  luaL_checkstack(state, 4, nullptr);
  lua_rawgetp(state, LUA_REGISTRYINDEX, &kLargeNumbers);
  if (lua_rawgeti(state, -1, bits) == LUA_TNIL) {
    lua_pop(state, 1);
    *static_cast<uint64_t*>(lua_newuserdatauv(state, sizeof(uint64_t), 0)) = value;
    luaL_setmetatable(state, kLargeNumber);
    lua_pushvalue(state, -1);
    lua_rawseti(state, -3, bits);
  }
  lua_remove(state, -2);
}

std::optional<uint64_t> to_unsigned(lua_State* state, int index) {
  if (const uint64_t* const number = large_number(state, index)) return *number;
  if (lua_isinteger(state, index) != 0) {
    const lua_Integer integer = lua_tointeger(state, index);
    return integer < 0 ? std::nullopt : std::optional<uint64_t>(integer);
  }
  if (lua_type(state, index) == LUA_TNUMBER) {
    const double number = lua_tonumber(state, index);
    const bool exact = number >= 0 && number <= kExactFloats && number == std::floor(number);
    return exact ? std::optional<uint64_t>(static_cast<uint64_t>(number)) : std::nullopt;
  }
  if (lua_type(state, index) != LUA_TSTRING) return std::nullopt;
  size_t size = 0;
  const char* const bytes = lua_tolstring(state, index, &size);
  const absl::string_view text(bytes, size);
  uint64_t value = 0;
  const bool hexadecimal = text.size() > 2 && text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
  const bool read = hexadecimal ? absl::SimpleHexAtoi(text, &value) : absl::SimpleAtoi(text, &value);
  return read ? std::optional<uint64_t>(value) : std::nullopt;
}

std::string text_of_number(double value) {
  char text[32];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  return {text, end.ptr};
}

}  // namespace locus::cli
