#include "client/cli/script/sandbox.h"

#include <algorithm>
#include <cstdlib>
#include <new>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/failure.h"
#include "client/lib/status.h"
#include "core/base/check.h"

namespace locus::cli {
namespace {

constexpr char kError[] = "locus.error";  // name of the metatable of errors
constexpr int kCountStep = 1000;          // instructions between two checks of the limits
const char kEndError = 0;                 // its address is the registry's key of the error that ends a script

// Error that a script can catch.
struct ScriptError {
  absl::Status status;
  std::string file;
  int line = 0;

  std::string text() const {
    return file.empty() ? std::string(status.message()) : absl::StrCat(file, ":", line, ": ", status.message());
  }
};

ScriptError* error_at(lua_State* state, int index) {
  return static_cast<ScriptError*>(luaL_testudata(state, index, kError));
}

// Sets file and line of `error` to the innermost line of Lua that runs. Allocates no memory of Lua.
void find_place(lua_State* state, ScriptError& error) {
  lua_Debug entry;
  for (int level = 0; lua_getstack(state, level, &entry) != 0; ++level) {
    lua_getinfo(state, "Sl", &entry);
    if (entry.currentline <= 0 || absl::string_view(entry.source) == kHiddenChunk) continue;
    error.file = entry.short_src;
    error.line = entry.currentline;
    return;
  }
}

void push_text(lua_State* state, absl::string_view text) { lua_pushlstring(state, text.data(), text.size()); }

int error_text(lua_State* state) {
  push_text(state, error_at(state, 1)->text());
  return 1;
}

int free_error(lua_State* state) {
  error_at(state, 1)->~ScriptError();
  return 0;
}

int error_field(lua_State* state) {
  const ScriptError& error = *error_at(state, 1);
  const std::string name = luaL_checkstring(state, 2);
  const std::optional<v1::Error> details = client::error_of(error.status);
  if (name == "message") {
    push_text(state, error.status.message());
  } else if (name == "code") {
    push_text(state, absl::StatusCodeToString(error.status.code()));
  } else if (name == "reason") {
    push_text(state, failure_name(error.status));
  } else if (name == "file" && !error.file.empty()) {
    push_text(state, error.file);
  } else if (name == "line" && !error.file.empty()) {
    lua_pushinteger(state, error.line);
  } else if (name == "field" && details && !details->field().empty()) {
    push_text(state, details->field());
  } else if (name == "limit" && details && !details->limit().empty()) {
    push_text(state, details->limit());
  } else if (name == "index" && details && details->has_index()) {
    lua_pushinteger(state, details->index());
  } else {
    lua_pushnil(state);
  }
  return 1;
}

int refuse_unsafe(lua_State* state) {
  raise(state, absl::FailedPreconditionError(absl::StrCat(lua_tostring(state, lua_upvalueindex(1)),
                                                          " is not available to scripts: run them with --unsafe")));
}

// Replaces the function `name` of the library `library` by one that raises an error.
void refuse_function(lua_State* state, const char* library, const char* name) {
  lua_getglobal(state, library);
  lua_pushfstring(state, "%s.%s", library, name);
  lua_pushcclosure(state, refuse_unsafe, 1);
  lua_setfield(state, -2, name);
  lua_pop(state, 1);
}

// Replaces the functions of the library `debug`, which can remove the limits, except the one that only reports.
void refuse_debug(lua_State* state) {
  lua_getglobal(state, "debug");
  lua_pushnil(state);
  while (lua_next(state, -2) != 0) {
    lua_pop(state, 1);
    const std::string name = lua_tostring(state, -1);
    if (name == "traceback") continue;
    lua_pushfstring(state, "debug.%s", name.c_str());
    lua_pushcclosure(state, refuse_unsafe, 1);
    lua_setfield(state, -3, name.c_str());
  }
  lua_pop(state, 1);
}

// Searcher of require for modules in Lua, of text only: Lua's own searcher also loads compiled modules.
int find_module(lua_State* state) {
  lua_getglobal(state, "package");
  lua_getfield(state, -1, "searchpath");
  lua_pushvalue(state, 1);
  lua_getfield(state, -3, "path");
  lua_call(state, 2, 2);
  if (lua_isnil(state, -2)) return 1;  // the text that lists the files that were tried
  lua_pop(state, 1);
  const char* const file = lua_tostring(state, -1);
  if (luaL_loadfilex(state, file, "t") != LUA_OK) lua_error(state);
  lua_pushstring(state, file);
  return 2;
}

// load() of Lua, for texts only.
int load_text(lua_State* state) {
  lua_settop(state, 4);
  const bool has_environment = !lua_isnil(state, 4);
  lua_pushvalue(state, lua_upvalueindex(1));
  lua_pushvalue(state, 1);
  lua_pushvalue(state, 2);
  lua_pushliteral(state, "t");
  if (has_environment) lua_pushvalue(state, 4);
  lua_call(state, has_environment ? 4 : 3, 2);
  return 2;
}

// setmetatable() of Lua without finalizers, in which Lua checks no limits.
int set_metatable(lua_State* state) {
  if (lua_istable(state, 2)) {
    lua_pushliteral(state, "__gc");
    if (lua_rawget(state, 2) != LUA_TNIL)
      raise(state, absl::FailedPreconditionError("__gc is not available to scripts: run them with --unsafe"));
  }
  lua_settop(state, 2);
  lua_pushvalue(state, lua_upvalueindex(1));
  lua_insert(state, 1);
  lua_call(state, 2, 1);
  return 1;
}

// Functions in Lua that replace those of the libraries whose loops or calls the limits would not end: the handler of
// xpcall() would run without checks, as would a closing variable of a coroutine that a limit has ended, and functions
// in C could count to 2^63.
constexpr char kBoundedFunctions[] = R"LUA(
local begin_coroutine, refuse_if_ended = ...
local pcall, error, select, type = pcall, error, select, type
local pack, unpack, resume, close = table.pack, table.unpack, coroutine.resume, coroutine.close
local create = coroutine.create
local most <const> = 1e8

function xpcall(f, handler, ...)
  local results = pack(pcall(f, ...))
  if results[1] then return unpack(results, 1, results.n) end
  return false, handler(results[2])
end

function coroutine.create(f)
  begin_coroutine()
  return create(f)
end

local function finish(ok, ...)
  if ok then return ... end
  error((...), 0)
end

function coroutine.wrap(f)
  local thread = coroutine.create(f)
  return function(...) return finish(resume(thread, ...)) end
end

function coroutine.close(thread)
  refuse_if_ended()
  return close(thread)
end

local repeated = string.rep
function string.rep(text, count, separator)
  if #text + #(separator or "") == 0 then return "" end
  return repeated(text, count, separator)
end

local moved = table.move
function table.move(from, first, last, to, target)
  if last - first > most then error("table.move of too many values", 2) end
  return moved(from, first, last, to, target or from)
end

for _, name in ipairs{"insert", "remove", "sort"} do
  local whole = table[name]
  table[name] = function(list, ...)
    if type(list) == "table" and #list > most then error("table." .. name .. " of too many values", 2) end
    return whole(list, ...)
  end
end
)LUA";

void wrap_global(lua_State* state, const char* name, lua_CFunction wrapper) {
  lua_getglobal(state, name);
  lua_pushcclosure(state, wrapper, 1);
  lua_setglobal(state, name);
}

}  // namespace

void push_error(lua_State* state, absl::Status status) {
  ScriptError error = {std::move(status), "", 0};
  find_place(state, error);
  new (lua_newuserdatauv(state, sizeof(ScriptError), 0)) ScriptError(std::move(error));
  luaL_setmetatable(state, kError);
}

void raise(lua_State* state, absl::Status status) {
  push_error(state, std::move(status));
  lua_error(state);
  std::abort();  // lua_error() does not return
}

absl::Status status_of(lua_State* state, int index) {
  if (const ScriptError* const error = error_at(state, index))
    return error->file.empty() ? error->status : with_place(error->status, absl::StrCat(error->file, ":", error->line));
  // Converts without metamethods, which could raise an error that nobody catches.
  if (lua_isstring(state, index) == 0)
    return absl::FailedPreconditionError(absl::StrCat("the error is a ", luaL_typename(state, index)));
  size_t size = 0;
  const char* const text = lua_tolstring(state, index, &size);
  return absl::FailedPreconditionError(absl::string_view(text, size));
}

Sandbox::Sandbox(const ScriptLimits& limits) : limits_(limits), state_(lua_newstate(allocate, this), lua_close) {
  lua_State* const state = state_.get();
  *static_cast<Sandbox**>(lua_getextraspace(state)) = this;  // Lua copies this pointer to every coroutine
  luaL_newmetatable(state, kError);
  const luaL_Reg functions[] = {
      {"__tostring", error_text}, {"__index", error_field}, {"__gc", free_error}, {nullptr, nullptr}};
  luaL_setfuncs(state, functions, 0);
  lua_pushliteral(state, "locus.error");
  lua_setfield(state, -2, "__metatable");  // scripts must not call __gc
  lua_pop(state, 1);
  lua_pushliteral(state, "the script has ended");
  lua_rawsetp(state, LUA_REGISTRYINDEX, &kEndError);
  open_libraries();
  lua_sethook(state, on_count, LUA_MASKCOUNT, kCountStep);
}

Sandbox::~Sandbox() = default;

void Sandbox::open_libraries() {
  lua_State* const state = state_.get();
  luaL_openlibs(state);
  if (limits_.unsafe) return;
  for (const char* const name : {"execute", "exit"}) refuse_function(state, "os", name);
  refuse_function(state, "io", "popen");
  refuse_function(state, "package", "loadlib");
  refuse_debug(state);
  refuse_function(state, "string", "dump");
  // package.searchers: 1 = preloaded modules, 2 = files of Lua, 3 and 4 = libraries of C.
  lua_getglobal(state, "package");
  lua_getfield(state, -1, "searchers");
  lua_pushcfunction(state, find_module);
  lua_rawseti(state, -2, 2);
  for (const int searcher : {4, 3}) {
    lua_pushnil(state);
    lua_rawseti(state, -2, searcher);
  }
  lua_pop(state, 1);
  lua_pushliteral(state, "");
  lua_setfield(state, -2, "cpath");
  lua_pop(state, 1);
  wrap_global(state, "load", load_text);
  wrap_global(state, "setmetatable", set_metatable);
  luaL_getmetatable(state, LUA_FILEHANDLE);
  lua_pushliteral(state, "FILE*");
  lua_setfield(state, -2, "__metatable");  // scripts must not replace the finalizer of files
  lua_pop(state, 1);
  LOCUS_CHECK_EQ(luaL_loadbufferx(state, kBoundedFunctions, sizeof kBoundedFunctions - 1, kHiddenChunk, "t"), LUA_OK);
  lua_pushcfunction(state, begin_coroutine);
  lua_pushcfunction(state, refuse_if_ended);
  LOCUS_CHECK_EQ(lua_pcall(state, 2, 0, 0), LUA_OK);
  for (const char* const name : {"dofile", "loadfile"}) {
    lua_pushnil(state);
    lua_setglobal(state, name);
  }
}

absl::Status Sandbox::load(const std::string& name, absl::string_view text) {
  lua_State* const state = state_.get();
  const int code = luaL_loadbufferx(state, text.data(), text.size(), name.c_str(), "t");
  if (code == LUA_OK) return absl::OkStatus();
  const std::string message = lua_tostring(state, -1);
  lua_pop(state, 1);
  return code == LUA_ERRMEM ? absl::ResourceExhaustedError(message) : usage_error(message);
}

bool Sandbox::is_incomplete(const absl::Status& status) { return absl::EndsWith(status.message(), "near <eof>"); }

absl::Status Sandbox::call(int arguments, int results) {
  lua_State* const state = state_.get();
  instructions_ = 0;
  deadline_ = limits_.time > absl::ZeroDuration() ? absl::Now() + limits_.time : absl::InfiniteFuture();
  interrupted_ = false;
  const int code = lua_pcall(state, arguments, results, 0);
  lua_sethook(state, on_count, LUA_MASKCOUNT, kCountStep);
  if (absl::Status ended = std::exchange(ended_, absl::OkStatus()); !ended.ok()) {
    lua_settop(state, 0);
    return ended;
  }
  if (code == LUA_OK) return absl::OkStatus();
  absl::Status status;
  if (code == LUA_ERRMEM) {
    status = absl::ResourceExhaustedError(absl::StrCat(memory_place_, memory_place_.empty() ? "" : ": ",
                                                       "the script needs more than its limit of ",
                                                       limits_.memory_bytes >> 20, " MiB of memory (--max-memory)"));
  } else if (code < LUA_OK) {
    status = absl::InternalError("a function of locus has failed");  // a C++ exception, which Lua does not know
  } else {
    status = status_of(state, -1);
  }
  lua_pop(state, 1);
  return status;
}

void Sandbox::wait(absl::Duration duration) const {
  constexpr absl::Duration kPoll = absl::Milliseconds(20);
  const absl::Time end = std::min(absl::Now() + duration, deadline_);
  while (!interrupted_ && absl::Now() < end) absl::SleepFor(std::min(kPoll, end - absl::Now()));
}

// A new coroutine begins its own count, so its creation counts as a whole step.
int Sandbox::begin_coroutine(lua_State* state) {
  Sandbox& self = of(state);
  self.instructions_ += kCountStep;
  self.check(state);
  return 0;
}

int Sandbox::refuse_if_ended(lua_State* state) {
  of(state).check(state);
  return 0;
}

void Sandbox::check(lua_State* state) {
  if (ended_.ok()) check_limits(state);
  if (ended_.ok()) return;
  // Raise the error at every instruction from now on, so that the script cannot go on after it has caught the error.
  lua_sethook(state, on_count, LUA_MASKCOUNT, 1);
  lua_rawgetp(state, LUA_REGISTRYINDEX, &kEndError);
  lua_error(state);
}

void* Sandbox::allocate(void* sandbox, void* block, size_t old_size, size_t size) {
  Sandbox& self = *static_cast<Sandbox*>(sandbox);
  const size_t old_bytes = block == nullptr ? 0 : old_size;  // otherwise `old_size` is the kind of the new object
  if (size == 0) {
    std::free(block);
    self.memory_bytes_ -= old_bytes;
    return nullptr;
  }
  const uint64_t limit = self.limits_.memory_bytes;
  if (limit > 0 && size > old_bytes && self.memory_bytes_ - old_bytes + size > limit) {
    if (self.state_ != nullptr) {
      ScriptError error;
      find_place(self.state_.get(), error);
      if (!error.file.empty()) self.memory_place_ = absl::StrCat(error.file, ":", error.line);
    }
    return nullptr;
  }
  void* const moved = std::realloc(block, size);
  if (moved != nullptr) self.memory_bytes_ += size - old_bytes;
  return moved;
}

void Sandbox::on_count(lua_State* state, lua_Debug*) {
  Sandbox& self = of(state);
  self.instructions_ += kCountStep;
  self.check(state);
}

void Sandbox::check_limits(lua_State* state) {
  absl::Status status;
  if (interrupted_) {
    status = absl::CancelledError("interrupted");
  } else if (limits_.instructions > 0 && instructions_ > limits_.instructions) {
    status = absl::ResourceExhaustedError(absl::StrCat("the script ran more than its limit of ", limits_.instructions,
                                                       " instructions of Lua (--max-instructions)"));
  } else if (absl::Now() > deadline_) {
    status = absl::ResourceExhaustedError(absl::StrCat("the script ran longer than its limit of ",
                                                       absl::FormatDuration(limits_.time), " (--max-seconds)"));
  } else {
    return;
  }
  ScriptError error = {status, "", 0};
  find_place(state, error);
  ended_ = error.file.empty() ? status : with_place(status, absl::StrCat(error.file, ":", error.line));
}

}  // namespace locus::cli
