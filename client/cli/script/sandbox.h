// Lua interpreter with limits: the standard libraries without the functions that reach beyond the script, a limit of
// instructions, memory and time, and errors that carry an absl::Status. Knows nothing of locus. Scripts are text: the
// compiled form of Lua, which the interpreter does not check, is refused.
//
// Threads: one thread runs scripts; any thread may call interrupt().
#ifndef LOCUS_CLIENT_CLI_SCRIPT_SANDBOX_H_
#define LOCUS_CLIENT_CLI_SCRIPT_SANDBOX_H_

#include <atomic>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/cli/script/script_limits.h"
#include "lua.hpp"

namespace locus::cli {

// Name of chunks whose lines are not reported as the place of an error: the Lua part of the module `locus`.
inline constexpr char kHiddenChunk[] = "=locus";

// Raises `status`, which must be an error, as an error of the script. In Lua the error is an object with the fields
// message, code, reason, field, index, limit, file and line; tostring() returns "FILE:LINE: MESSAGE". The place is that
// of the innermost Lua function outside of kHiddenChunk. Must be called from a function that Lua called.
[[noreturn]] void raise(lua_State* state, absl::Status status);

// Pushes the object with which raise() would raise `status`.
void push_error(lua_State* state, absl::Status status);

// Returns the status of the value at `index`, which a failed call has left: the raised status with its place, or
// FAILED_PRECONDITION with the text of another value.
absl::Status status_of(lua_State* state, int index);

class Sandbox {
 public:
  explicit Sandbox(const ScriptLimits& limits);
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  lua_State* state() { return state_.get(); }
  // Returns the sandbox to which a state or a coroutine belongs.
  static Sandbox& of(lua_State* state) { return **static_cast<Sandbox**>(lua_getextraspace(state)); }

  // Compiles `text` and pushes the function. Returns a usage error with file and line if the text is not Lua.
  // is_incomplete() returns whether more text could complete a text that does not compile.
  absl::Status load(const std::string& name, absl::string_view text);
  static bool is_incomplete(const absl::Status& status);

  // Calls the function below the `arguments` values on top of the stack, and replaces them by its `results`. Resets the
  // counts of instructions and time. When a limit is exceeded, the script ends, whatever it catches, with
  // RESOURCE_EXHAUSTED, and after interrupt() with CANCELLED; the message names file, line and the limit.
  absl::Status call(int arguments, int results);

  // Ends the running script as soon as it executes its next instructions.
  void interrupt() { interrupted_ = true; }
  bool interrupted() const { return interrupted_; }

  // Raises the error of an exceeded limit or of interrupt(). For functions in C++ that take long; also every 1,000
  // instructions of Lua.
  void check(lua_State* state);

  // Waits for `duration`, or until the script has no time left or interrupt() is called.
  void wait(absl::Duration duration) const;

 private:
  static void* allocate(void* sandbox, void* block, size_t old_size, size_t size);
  static int begin_coroutine(lua_State* state);
  static int refuse_if_ended(lua_State* state);
  static void on_count(lua_State* state, lua_Debug* unused);
  void open_libraries();
  void check_limits(lua_State* state);

  const ScriptLimits limits_;
  uint64_t memory_bytes_ = 0;
  uint64_t instructions_ = 0;
  absl::Time deadline_ = absl::InfiniteFuture();
  std::atomic<bool> interrupted_ = false;
  absl::Status ended_;        // error of the exceeded limit; OK while no limit is exceeded
  std::string memory_place_;  // FILE:LINE at which memory was last refused
  std::unique_ptr<lua_State, void (*)(lua_State*)> state_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_SANDBOX_H_
