// Variables with known values, on which the tests of this folder evaluate expressions and expectations.
#ifndef LOCUS_TESTS_CLIENT_CLI_SCRIPT_SCRIPT_VALUES_H_
#define LOCUS_TESTS_CLIENT_CLI_SCRIPT_SCRIPT_VALUES_H_

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "client/cli/script/variables.h"

namespace locus::cli::testing {

// Returns a result of a query whose rows are the JSON list `rows`.
inline Value result_of(const std::string& rows) {
  Report report;
  report.head = {{"epoch", "18446744073709551615"}, {"revision", 12}, {"min", {1.5, 2.0, 3.0}}};
  report.rows_name = "hits";
  const Json parsed = Json::parse(rows);
  report.rows.assign(parsed.begin(), parsed.end());
  return Value::of(std::make_shared<const Report>(std::move(report)));
}

// Returns these variables: `shot`, a result with one row; `near`, a result with three rows; `none`, a result without
// rows; `miss`, a result with one row that is not a hit; `big`, an id of 64 bits; `n`, 3; `p`, a vector; `word`, a
// text; `later`, a value that is not known yet.
inline Variables some_variables() {
  Variables variables;
  const auto set = [&](const std::string& name, Value value) {
    EXPECT_TRUE(variables.set(name, std::move(value)).ok()) << name;
  };
  set("shot", result_of(R"([{"ray": 0, "hit": true, "t": 69.5, "id": "7", "point": [0.0, 0.0, 30.5]}])"));
  set("near", result_of(R"([{"id": "7"}, {"id": "9223372036854775809"}, {"id": "100"}])"));
  set("none", result_of("[]"));
  set("miss", result_of(R"([{"ray": 0, "hit": false, "t": null, "id": null}])"));
  set("big", Value::of(Json("9223372036854775809")));
  set("n", Value::of(Json(3)));
  set("p", Value::of(Json({1, 2, 3})));
  set("word", Value::of(Json("two words")));
  set("later", Value::unknown());
  return variables;
}

}  // namespace locus::cli::testing

#endif  // LOCUS_TESTS_CLIENT_CLI_SCRIPT_SCRIPT_VALUES_H_
