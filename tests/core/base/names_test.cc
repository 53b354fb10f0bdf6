#include "core/base/names.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/refusal.h"

namespace locus::test {
namespace {

// Expects that `status` is a refusal with the reason kMalformed and the field `field`.
void expect_malformed(const absl::Status& status, const std::string& field) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const auto refusal = refusal_of(status);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, Reason::kMalformed);
  EXPECT_EQ(refusal->field, field);
}

TEST(NamesTest, SceneNamesFollowTheirRule) {
  for (const std::string& name : {std::string("a"), std::string("a1"), std::string("a-b"), std::string("z--9"),
                                  std::string("a_b"), std::string("team.match-7_b"), std::string(63, 'x')})
    EXPECT_TRUE(check_scene_name(name, "name").ok()) << name;
  for (const std::string& name :
       {std::string(), std::string("1a"), std::string("-a"), std::string("a-"), std::string("A"), std::string("a_"),
        std::string("a."), std::string("_a"), std::string(".a"), std::string("a b"), std::string("\xc3\xa4"),
        std::string(64, 'x'), std::string("a\0b", 3)})
    expect_malformed(check_scene_name(name, "name"), "name");
}

TEST(NamesTest, MeshNamesFollowTheirRule) {
  for (const std::string& name : {std::string("A/b.obj#1"), std::string("0"), std::string(63, '~')})
    EXPECT_TRUE(check_mesh_name(name, "mesh").ok()) << name;
  for (const std::string& name : {std::string(), std::string("a b"), std::string(64, 'x'), std::string("a\n")})
    expect_malformed(check_mesh_name(name, "mesh"), "mesh");
}

}  // namespace
}  // namespace locus::test
