#include "client/cli/unknown_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/failure.h"
#include "client/cli/run.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kMark(1, kNotKnownYet);

class UnknownValuesTest : public ::testing::Test {
 protected:
  absl::Status check(const std::vector<std::string>& line) {
    context_.set_lines(Lines::kScriptCheck);
    return run_script_line(line, context_);
  }

  std::ostringstream out_;
  Context context_{out_, out_, Progress::kSilent};
};

TEST_F(UnknownValuesTest, AnyOptionAcceptsAnUnknownValue) {
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {"query", "ray", kMark, "--from", kMark, "--dir", kMark, "--mode", kMark, "--t-max", kMark, "--mask", kMark},
           {"query", "ray", "a", "--from=" + kMark, "--dir=0,0,1", "--columns", kMark, "-o", kMark},
           {"insert", kMark, kMark, "--id", kMark, "--at", kMark, "--rotation", kMark, "--tick", kMark},
           {"generate", "city", "--scene", kMark, "--triangles", kMark},
           {"scene", "create", kMark, "--label", "k=" + kMark}}) {
    EXPECT_EQ(check(line), absl::OkStatus()) << ::testing::PrintToString(line);
  }
}

TEST_F(UnknownValuesTest, OtherMistakesAreStillReported) {
  EXPECT_THAT(std::string(check({"insert", "a", "--id", kMark}).message()), HasSubstr("SHAPE is required"));
  EXPECT_EQ(exit_code_of(check({"query", "ray", "a", "--from", kMark, "--dir", kMark, "--nope"})), ExitCode::kUsage);
  EXPECT_EQ(exit_code_of(check({"query", kMark})), ExitCode::kUsage) << "a command is never unknown";
}

TEST_F(UnknownValuesTest, ACheckedLineWritesNothing) {
  EXPECT_EQ(check({"version"}), absl::OkStatus());
  EXPECT_EQ(check({"--help"}), absl::OkStatus());
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(UnknownValuesTest, HasUnknownFindsTheMarkInAnyArgument) {
  EXPECT_TRUE(has_unknown({"a", "b" + kMark + "c"}));
  EXPECT_FALSE(has_unknown({"a", ""}));
}

}  // namespace
}  // namespace locus::cli
