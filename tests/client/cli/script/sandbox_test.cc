// Limits of scripts: a script that loops, eats memory or reaches beyond itself ends with file, line and limit, whatever
// it catches.
#include "client/cli/script/sandbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "client/cli/failure.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

absl::Status run(const std::string& text, const ScriptLimits& limits = {}) {
  Sandbox sandbox(limits);
  if (absl::Status loaded = sandbox.load("@x.lua", text); !loaded.ok()) return loaded;
  return sandbox.call(0, 0);
}

std::string message_of(const absl::Status& status) { return std::string(status.message()); }

constexpr ScriptLimits kFewInstructions = {.instructions = 1'000'000};

TEST(SandboxTest, EndlessLoopsEndWithPlaceAndLimit) {
  for (const char* text : {
           "\nwhile true do end",
           "\nlocal function f() return f() end f()",
           "\npcall(function() while true do end end)",
           "\nwhile true do pcall(function() while true do end end) end",
           "\ncoroutine.wrap(function() while true do end end)()",
           "\nlocal c = coroutine.create(function() while true do coroutine.yield() end end)"
           " while true do coroutine.resume(c) end",
           "\ntable.sort({1, 2, 3}, function() while true do end end)",
           "\nlocal t <close> = setmetatable({}, {__close = function() while true do end end}) while true do end",
           "\nload('while true do end')()",
           "\nxpcall(function() while true do end end, function() while true do end end)",
           "\nxpcall(error, function() while true do end end)",
           "\nlocal function f(d) if d == 0 then return end for i = 1, 50 do coroutine.wrap(f)(d - 1) end end"
           " for i = 1, 10 do coroutine.wrap(f)(100) end",
           "\nlocal function f() local t <close> = setmetatable({}, {__close = function() while true do end end})"
           " while true do end end coroutine.wrap(f)()",
           "\nlocal function f() local t <close> = setmetatable({}, {__close = function() while true do end end})"
           " while true do end end local c = coroutine.create(f) coroutine.resume(c) coroutine.close(c)",
       }) {
    const absl::Status status = run(text, kFewInstructions);
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << text << status;
    EXPECT_THAT(message_of(status), HasSubstr(":"));
    EXPECT_THAT(message_of(status), HasSubstr("its limit of 1000000 instructions of Lua (--max-instructions)")) << text;
  }
  EXPECT_THAT(message_of(run("\nwhile true do end", kFewInstructions)), StartsWith("x.lua:2: "));
}

TEST(SandboxTest, MemoryEndsWithPlaceAndLimit) {
  const ScriptLimits small = {.memory_bytes = 8u << 20};
  for (const char* text : {
           "\n\nlocal t = {} while true do t[#t + 1] = ('x'):rep(1000) .. #t end",
           "\n\nlocal s = 'x' while true do s = s .. s end",
           "\n\nlocal s = ('x'):rep(1 << 30)",
       }) {
    const absl::Status status = run(text, small);
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << text << status;
    EXPECT_THAT(message_of(status), StartsWith("x.lua:3: "));
    EXPECT_THAT(message_of(status), HasSubstr("its limit of 8 MiB of memory (--max-memory)"));
  }
  EXPECT_EQ(run("for i = 1, 1000 do local s = ('x'):rep(1 << 20) end", small), absl::OkStatus())
      << "garbage counts not";
}

TEST(SandboxTest, TimeEndsAScriptThatWaits) {
  Sandbox sandbox({.time = absl::Milliseconds(50)});
  ASSERT_EQ(sandbox.load("@x.lua", "while true do end"), absl::OkStatus());
  const absl::Status status = sandbox.call(0, 0);
  EXPECT_THAT(message_of(status), HasSubstr("ran longer than its limit of 50ms (--max-seconds)"));
}

TEST(SandboxTest, InterruptEndsAScriptFromAnotherThreadAndTheNextCallRuns) {
  Sandbox sandbox({});
  ASSERT_EQ(sandbox.load("@x.lua", "started = true while true do pcall(function() while true do end end) end"),
            absl::OkStatus());
  std::atomic<bool> ended = false;
  std::thread interrupts([&] {
    while (!ended) sandbox.interrupt();
  });
  const absl::Status status = sandbox.call(0, 0);
  ended = true;
  interrupts.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_THAT(message_of(status), EndsWith("interrupted"));
  ASSERT_EQ(sandbox.load("@x.lua", "started = false"), absl::OkStatus());
  EXPECT_EQ(sandbox.call(0, 0), absl::OkStatus());
}

TEST(SandboxTest, FunctionsThatReachBeyondTheScriptNeedUnsafe) {
  const struct {
    const char* text;
    const char* name;
  } cases[] = {{"os.execute('true')", "os.execute"},
               {"os.exit(0)", "os.exit"},
               {"io.popen('true')", "io.popen"},
               {"package.loadlib('libm.so.6', 'cos')", "package.loadlib"},
               {"debug.sethook()", "debug.sethook"},
               {"require('debug').getregistry()", "debug.getregistry"},
               {"setmetatable({}, {__gc = function() end})", "__gc"}};
  for (const auto& [text, name] : cases) {
    const absl::Status status = run(text);
    EXPECT_THAT(message_of(status), StartsWith("x.lua:1: ")) << text;
    EXPECT_THAT(status.message(),
                HasSubstr(std::string(name) + " is not available to scripts: run them with --unsafe"));
  }
  EXPECT_EQ(run("assert(os.execute('true')) setmetatable({}, {__gc = function() end})", {.unsafe = true}),
            absl::OkStatus());
}

TEST(SandboxTest, ModulesInCAndCompiledTextsAreRefused) {
  EXPECT_THAT(message_of(run("require('lfs')")), HasSubstr("module 'lfs' not found"));
  EXPECT_EQ(run("assert(#package.searchers == 2 and package.cpath == '')"), absl::OkStatus());
  EXPECT_EQ(run("assert(load('\\27LuaT') == nil)"), absl::OkStatus());
  EXPECT_EQ(run("assert(load('\\27LuaT', 'x', 'b') == nil)"), absl::OkStatus());
  EXPECT_EQ(run("assert(load('return a', 'x', 't', {a = 5})() == 5)"), absl::OkStatus());
  EXPECT_EQ(exit_code_of(run("\x1bLua")), ExitCode::kUsage);
}

TEST(SandboxTest, RequireLoadsModulesInLuaButNoCompiledOnes) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("good.lua")) << "return {value = 5}";
  std::ofstream(folder.file("compiled.lua"), std::ios::binary) << "\x1bLuaT";
  const std::string path = "package.path = '" + folder.file("?.lua") + "' ";
  EXPECT_EQ(run(path + "assert(require('good').value == 5)"), absl::OkStatus());
  EXPECT_THAT(message_of(run(path + "require('compiled')")), HasSubstr("attempt to load a binary chunk"));
  EXPECT_THAT(message_of(run("string.dump(print)")), HasSubstr("string.dump is not available"));
}

TEST(SandboxTest, FilesKeepTheirFinalizer) {
  EXPECT_EQ(run("assert(getmetatable(io.stdout) == 'FILE*')"), absl::OkStatus());
}

TEST(SandboxTest, FunctionsInCCountOnlyToABound) {
  EXPECT_THAT(message_of(run("table.move({}, 1, math.maxinteger - 1, 2)")), HasSubstr("too many values"));
  EXPECT_THAT(
      message_of(run("table.insert(setmetatable({}, {__len = function() return math.maxinteger - 1 end}), 1, 5)")),
      HasSubstr("too many values"));
  EXPECT_EQ(run("assert(string.rep('', math.maxinteger) == '' and ('ab'):rep(2, '-') == 'ab-ab')"), absl::OkStatus());
  EXPECT_EQ(
      run("local t = {3, 1, 2} table.sort(t) table.insert(t, 4) table.insert(t, 1, 0) assert(table.concat(t) == '01234'"
          " and table.remove(t) == 4 and table.remove(t, 1) == 0 and #table.move(t, 1, 3, 2) == 4)"),
      absl::OkStatus());
}

TEST(SandboxTest, CoroutinesAndHandlersWorkAsInLua) {
  EXPECT_EQ(run("local next = coroutine.wrap(function(a) local b = coroutine.yield(a + 1) return a + b end)"
                " assert(next(1) == 2 and next(5) == 6)"
                " local ok, e = pcall(coroutine.wrap(function() error('x', 0) end)) assert(not ok and e == 'x')"
                " local co = coroutine.create(function() coroutine.yield() end) coroutine.resume(co)"
                " assert(coroutine.close(co) and coroutine.status(co) == 'dead')"
                " assert(select('#', xpcall(function() return 1, nil end, print)) == 3)"
                " assert(select(2, xpcall(error, function(e) return e .. '!' end, 'x')) == 'x!')"),
            absl::OkStatus());
}

TEST(SandboxTest, ErrorsOfEveryTypeHaveAText) {
  for (const char* text : {"error(setmetatable({}, {__tostring = function() error('x') end}))",
                           "error(setmetatable({}, {__tostring = function() while true do end end}))", "error({})",
                           "error(print)", "error()"}) {
    EXPECT_THAT(message_of(run(text, kFewInstructions)), HasSubstr("the error is a ")) << text;
  }
}

TEST(SandboxTest, ErrorsNameFileAndLine) {
  EXPECT_EQ(run("\nerror('thrown')").message(), "x.lua:2: thrown");
  EXPECT_THAT(message_of(run("local x = 1 +")), HasSubstr("x.lua:1: unexpected symbol near <eof>"));
  EXPECT_EQ(exit_code_of(run("local x = 1 +")), ExitCode::kUsage);
  EXPECT_THAT(message_of(run("\n\ntable.sort({3, 2}, function() error('inside') end)")), StartsWith("x.lua:3: inside"));
}

TEST(SandboxTest, RaisedErrorsKeepTheirStatus) {
  Sandbox sandbox({});
  lua_State* const state = sandbox.state();
  lua_register(state, "fails", [](lua_State* inner) -> int { raise(inner, absl::NotFoundError("no such thing")); });
  ASSERT_EQ(sandbox.load("@x.lua", "\nfails()"), absl::OkStatus());
  EXPECT_EQ(sandbox.call(0, 0), absl::NotFoundError("x.lua:2: no such thing"));
  ASSERT_EQ(sandbox.load("@x.lua", R"(
local ok, found = pcall(fails)
assert(not ok and found.message == 'no such thing' and found.code == 'NOT_FOUND' and found.reason == 'NOT_FOUND')
local inner
ok, inner = pcall(function() fails() end)
assert(inner.file == 'x.lua' and inner.line == 5 and tostring(inner) == 'x.lua:5: no such thing')
assert(inner.field == nil and inner.unknown == nil and getmetatable(inner) == 'locus.error')
error(inner)
)"),
            absl::OkStatus());
  EXPECT_EQ(sandbox.call(0, 0), absl::NotFoundError("x.lua:5: no such thing"));
}

TEST(SandboxTest, OnlyTextsThatMoreLinesCompleteAreIncomplete) {
  Sandbox sandbox({});
  EXPECT_TRUE(Sandbox::is_incomplete(sandbox.load("=input", "for i = 1, 3 do")));
  EXPECT_TRUE(Sandbox::is_incomplete(sandbox.load("=input", "f(")));
  EXPECT_FALSE(Sandbox::is_incomplete(sandbox.load("=input", "for for")));
  EXPECT_FALSE(Sandbox::is_incomplete(absl::OkStatus()));
}

}  // namespace
}  // namespace locus::cli
