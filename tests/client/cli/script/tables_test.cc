// Conversions of tables, messages and JSON, and 64-bit numbers that keep all their bits.
#include "client/cli/script/tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/failure.h"
#include "client/cli/script/numbers.h"
#include "client/cli/script/sandbox.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/update_service.pb.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class TablesTest : public ::testing::Test {
 protected:
  TablesTest() { open_numbers(state()); }
  lua_State* state() { return sandbox_.state(); }

  // Evaluates a Lua expression and leaves its value on the stack.
  void evaluate(const std::string& expression) {
    ASSERT_EQ(sandbox_.load("=test", "return " + expression), absl::OkStatus());
    ASSERT_EQ(sandbox_.call(0, 1), absl::OkStatus());
  }
  template <class M>
  absl::Status read(const std::string& expression, M& message) {
    evaluate(expression);
    const absl::Status status = read_message(state(), -1, message);
    EXPECT_EQ(lua_gettop(state()), 1) << "the stack is unchanged";
    lua_settop(state(), 0);
    return status;
  }
  // Sets the global `value` to the value on the stack, and expects that `condition` is true.
  void expect_true(const std::string& condition) {
    lua_setglobal(state(), "value");
    evaluate(condition);
    EXPECT_TRUE(lua_toboolean(state(), -1)) << condition;
    lua_settop(state(), 0);
  }

  Sandbox sandbox_{ScriptLimits()};
};

constexpr uint64_t kNumbers[] = {0, 1, (1ull << 53) + 1, (1ull << 63) - 1, 1ull << 63, ~0ull - 1, ~0ull};

TEST_F(TablesTest, NumbersKeepAll64Bits) {
  for (const uint64_t number : kNumbers) {
    push_unsigned(state(), number);
    EXPECT_EQ(to_unsigned(state(), -1), number);
    lua_setglobal(state(), "a");
    push_unsigned(state(), number);
    expect_true("a == value and ({[a] = 5})[value] == 5 and '' .. a == '" + std::to_string(number) +
                "' and tostring(a) == '" + std::to_string(number) + "'");
    lua_pushstring(state(), std::to_string(number).c_str());
    EXPECT_EQ(to_unsigned(state(), -1), number);
    lua_settop(state(), 0);
  }
}

TEST_F(TablesTest, LargeNumbersCompareWithAllNumbers) {
  push_unsigned(state(), ~0ull);
  lua_setglobal(state(), "most");
  push_unsigned(state(), 1ull << 63);
  expect_true(
      "value < most and value <= value and not (value < value) and most > 5 and 5 < value and -1.5 < value and"
      " not (value < 7) and value >= 7 and value ~= most and math.maxinteger < value and value > math.maxinteger");
}

TEST_F(TablesTest, ValuesThatAreNoUnsignedNumbersAreRefused) {
  for (const char* value : {"-1", "0.5", "2.0^54", "1e300", "0/0", "'x'", "'-1'", "''", "{}", "true", "nil",
                            "'18446744073709551616'", "0xFFFFFFFFFFFFFFFF"}) {
    evaluate(value);
    EXPECT_EQ(to_unsigned(state(), -1), std::nullopt) << value;
    lua_settop(state(), 0);
  }
  evaluate("'0xFFFFFFFFFFFFFFFF'");
  EXPECT_EQ(to_unsigned(state(), -1), ~0ull);
  evaluate("7.0");
  EXPECT_EQ(to_unsigned(state(), -1), 7u);
}

TEST_F(TablesTest, NestedListsFillColumns) {
  v1::UpdateBatch batch;
  ASSERT_EQ(read("{tick = 7, inserts = {{ids = {1, '18446744073709551615'}, positions_f64 = {{0, 0, 1}, {0, 0, 2}},"
                 " ball = {radii = 0.5}}}, frame = {1, 2, 3}}",
                 batch),
            absl::OkStatus());
  EXPECT_EQ(batch.tick(), 7u);
  EXPECT_EQ(batch.frame().z(), 3);
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(1u, ~0ull));
  EXPECT_THAT(batch.inserts(0).positions_f64(), ElementsAre(0, 0, 1, 0, 0, 2));
  EXPECT_THAT(batch.inserts(0).ball().radii(), ElementsAre(0.5f));
}

TEST_F(TablesTest, EnumsAreNamesWithOrWithoutPrefix) {
  v1::QueryBatch batch;
  ASSERT_EQ(read("{blocks = {{source = 'static', columns = {'t', 'COLUMN_ID'}, rays = {mode = 'any'}}}}", batch),
            absl::OkStatus());
  EXPECT_EQ(batch.blocks(0).source(), v1::SOURCE_STATIC);
  EXPECT_THAT(batch.blocks(0).columns(), ElementsAre(v1::COLUMN_T, v1::COLUMN_ID));
  EXPECT_EQ(batch.blocks(0).rays().mode(), v1::RAY_MODE_ANY);
}

TEST_F(TablesTest, MapsAndOneMessageForAListAreRead) {
  v1::CreateSceneRequest request;
  ASSERT_EQ(read("{name = 'a', spec = {labels = {game = 'chess', room = '4'}}}", request), absl::OkStatus());
  EXPECT_EQ(request.spec().labels().at("room"), "4");
  v1::QueryBatch batch;
  ASSERT_EQ(read("{blocks = {balls = {centers = {0, 0, 0}}}}", batch), absl::OkStatus());
  EXPECT_EQ(batch.blocks_size(), 1);
  batch.Clear();
  ASSERT_EQ(read("{blocks = {}}", batch), absl::OkStatus());
  EXPECT_EQ(batch.blocks_size(), 0);
}

TEST_F(TablesTest, MistakesNameTheFieldAndTheNearestOne) {
  const struct {
    const char* table;
    const char* message;
  } cases[] = {
      {"{blocks = {{rayz = {}}}}", "blocks[1] has no field 'rayz'; did you mean `rays`?"},
      {"{blok = {}}", "the table has no field 'blok'; did you mean `blocks`?"},
      {"{1, 2}", "the table has fields with names, not 1"},
      {"{blocks = {{source = 'statik'}}}", "blocks[1].source has no value 'statik'; did you mean `static`?"},
      {"{blocks = {{source = 3}}}", "blocks[1].source must be the name of a value, not 3"},
      {"{blocks = {{rays = {origins = {0, 'x', 0}}}}}", "blocks[1].rays.origins[2] must be a number, not 'x'"},
      {"{blocks = {{masks = {2^32}}}}", "blocks[1].masks[1] must be an integer from 0 to 4294967295, not 4294967296.0"},
      {"{blocks = {{ignore_ids = {-1}}}}", "above 2^63-1: locus.id('...')"},
      {"{explain = 1}", "explain must be true or false, not 1"},
      {"{view = 5}", "view must be a table, not 5"},
      {"{blocks = 5}", "blocks must be a table, not 5"},
      {"{blocks = {{masks = {x = 1}}}}", "blocks[1].masks must be a list, not a table with names"},
  };
  for (const auto& [table, message] : cases) {
    v1::QueryBatch batch;
    const absl::Status status = read(table, batch);
    EXPECT_EQ(exit_code_of(status), ExitCode::kUsage) << table;
    EXPECT_THAT(status.message(), HasSubstr(message)) << table;
  }
}

TEST_F(TablesTest, TablesThatContainThemselvesAreRefused) {
  ASSERT_EQ(sandbox_.load("=test", "loop = {} loop[1] = loop view = {} "), absl::OkStatus());
  ASSERT_EQ(sandbox_.call(0, 0), absl::OkStatus());
  v1::QueryBatch batch;
  EXPECT_FALSE(read("{blocks = {{masks = loop}}}", batch).ok());
  evaluate("loop");
  EXPECT_FALSE(read_json(state(), -1).ok());
}

TEST_F(TablesTest, SharedTablesCountEachTime) {
  ASSERT_EQ(sandbox_.load("=test", "shared = {} for i = 1, 60 do shared = {shared, shared} end"), absl::OkStatus());
  ASSERT_EQ(sandbox_.call(0, 0), absl::OkStatus());
  evaluate("shared");
  EXPECT_THAT(read_json(state(), -1).status().message(), HasSubstr("more than 16000000 values"));
}

TEST_F(TablesTest, MessagesBecomeTables) {
  v1::QueryResult result;
  result.set_revision(5);
  v1::BlockResult& block = *result.add_blocks();
  block.add_ids(~0ull);
  block.add_t(0.5f);
  push_message(state(), result);
  expect_true(
      "value.revision == 5 and #value.blocks == 1 and tostring(value.blocks[1].ids[1]) == '18446744073709551615' and"
      " value.blocks[1].t[1] == 0.5 and #value.blocks[1].normals == 0 and value.work == nil and value.tick == 0");
}

TEST_F(TablesTest, JsonKeepsNumbersAndRows) {
  push_json(state(), Json::parse(R"({"epoch": "18446744073709551615", "revision": 9007199254740993, "name": "123",
    "missing": ["7"], "hits": [{"id": "9223372036854775808", "t": null, "hit": true, "x": -1, "r": 0.5}]})"));
  expect_true(
      "tostring(value.epoch) == '18446744073709551615' and value.revision == 9007199254740993 and value.name == '123'"
      " and value.missing[1] == 7 and tostring(value.hits[1].id) == '9223372036854775808' and value.hits[1].t == nil"
      " and value.hits[1].hit == true and value.hits[1].x == -1 and value.hits[1].r == 0.5");
}

TEST_F(TablesTest, TablesBecomeJsonWithTheIdFirst) {
  push_unsigned(state(), ~0ull);
  lua_setglobal(state(), "most");
  evaluate("{b = 1, a = {1.5, 'x'}, id = most, group = 7, n = most, e = {}}");
  EXPECT_EQ(json_line(*read_json(state(), -1)),
            R"({"id":"18446744073709551615","a":[1.5,"x"],"b":1,"e":{},"group":"7","n":18446744073709551615})");
}

TEST_F(TablesTest, NumbersHaveTheShortestTextThatReadsBack) {
  EXPECT_EQ(text_of_number(0.1), "0.1");
  EXPECT_EQ(text_of_number(-5), "-5");
  EXPECT_EQ(text_of_number(1.0 / 3), "0.3333333333333333");
}

}  // namespace
}  // namespace locus::cli
