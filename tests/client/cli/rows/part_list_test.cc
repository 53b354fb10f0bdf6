#include "client/cli/rows/part_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(PartListTest, WrongPartsAreNamed) {
  const auto refusal = [](const std::string& text) { return std::string(read_parts(text).status().message()); };
  EXPECT_THAT(refusal("ball"), HasSubstr("is no JSON list"));
  EXPECT_THAT(refusal("{}"), HasSubstr("is no JSON list"));
  EXPECT_THAT(refusal("[]"), HasSubstr("a compound has 1 to 64 parts, not 0"));
  std::string many = R"({"ball":1,"at":[0,0,0]})";
  for (int i = 0; i < 6; ++i) many = absl::StrCat(many, ",", many);
  EXPECT_TRUE(read_parts(absl::StrCat("[", many, "]")).ok());
  EXPECT_THAT(refusal(absl::StrCat("[", many, R"(,{"ball":1,"at":[0,0,0]}])")), HasSubstr("not 65"));
  EXPECT_THAT(refusal("[7]"), HasSubstr("part 0: is no object"));
  EXPECT_THAT(refusal(R"([{"at":[0,0,0]}])"), HasSubstr("part 0: needs one of ball, box and capsule"));
  EXPECT_THAT(refusal(R"([{"at":[0,0,0],"ball":1,"box":[1,1,1]}])"), HasSubstr("needs one of"));
  EXPECT_THAT(refusal(R"([{"at":[0,0,0],"cone":1}])"), HasSubstr("unknown key 'cone'"));
  EXPECT_THAT(refusal(R"([{"ball":1,"at":[0,0,0]},{"ball":1}])"), HasSubstr("part 1: at: is missing"));
  EXPECT_THAT(refusal(R"([{"ball":1,"at":[0,0]}])"), HasSubstr("at: is no list of 3 numbers"));
  EXPECT_THAT(refusal(R"([{"ball":"1","at":[0,0,0]}])"), HasSubstr("ball: is no number"));
  EXPECT_THAT(refusal(R"([{"ball":1e39,"at":[0,0,0]}])"), HasSubstr("ball: is no number"));
  EXPECT_THAT(refusal(R"([{"capsule":{"radius":1},"at":[0,0,0]}])"), HasSubstr("needs axis and radius"));
  EXPECT_THAT(refusal(R"([{"ball":1,"at":[0,0,0],"layers":-1}])"), HasSubstr("layers: is no whole number"));
}

TEST(PartListTest, PosesAreColumnsOfTheValuesThatAllPartsHave) {
  const absl::StatusOr<PoseColumns> both =
      read_poses(R"([{"at":[1,2,3],"rotation":[0,0,1,0]},{"at":[4,5,6],"rotation":[0,0,0,1]}])");
  ASSERT_TRUE(both.ok()) << both.status();
  EXPECT_EQ(both->parts_each, 2u);
  EXPECT_THAT(both->positions, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(both->rotations, ElementsAre(0, 0, 1, 0, 0, 0, 0, 1));
  EXPECT_THAT(read_poses(R"([{"rotation":[0,0,1,0]}])")->positions, IsEmpty());
  for (const char* wrong : {R"([{}])", R"([{"at":[1,2,3]},{"rotation":[0,0,1,0]}])", R"([{"at":[1,2,3]},{}])",
                            R"([{"at":[1,2,3],"ball":1}])", "[]"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(read_poses(wrong).status())) << wrong;
  }
}

}  // namespace
}  // namespace locus::cli
