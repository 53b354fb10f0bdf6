#include "client/cli/levels/import/gltf_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/levels/import/import_limits.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string refusal_of_gltf(const std::string& bytes) { return std::string(check_gltf(bytes).status().message()); }

std::string nodes_of(const std::string& nodes) { return R"({"nodes":[)" + nodes + "]}"; }

// Returns a chain of nodes, each the child of the previous one.
std::string chain(size_t depth) {
  std::string nodes;
  for (size_t i = 1; i < depth; ++i) nodes += R"({"children":[)" + std::to_string(i) + "]},";
  return nodes_of(nodes + "{}");
}

TEST(GltfCheckTest, BuffersAreListedOnceAndImagesNot) {
  const auto uris =
      check_gltf(R"({"images":[{"uri":"../x.png"}],"buffers":[{"uri":"a.bin","byteLength":3},)"
                 R"({"uri":"data:application/octet-stream;base64,AAAA"},{"uri":"a.bin"},{"uri":"b%20c.bin"}]})");
  ASSERT_TRUE(uris.ok()) << uris.status();
  EXPECT_THAT(*uris, ElementsAre("a.bin", "b%20c.bin"));
}

TEST(GltfCheckTest, BuffersOfVersion1AreListed) {
  EXPECT_THAT(check_gltf(R"({"buffers":{"geometry":{"uri":"a.bin"}}})").value(), ElementsAre("a.bin"));
}

TEST(GltfCheckTest, TheJsonPartOfAGlbIsChecked) {
  const std::string json = R"({"buffers":[{"uri":"a.bin"}]} )";
  std::string glb = "glTF";
  append_u32(glb, 2);
  append_u32(glb, static_cast<uint32_t>(20 + json.size()));
  append_u32(glb, static_cast<uint32_t>(json.size()));
  glb += "JSON" + json;
  EXPECT_THAT(check_gltf(glb).value(), ElementsAre("a.bin"));
  EXPECT_THAT(refusal_of_gltf(glb.substr(0, glb.size() - 1)), HasSubstr("declares"));
  EXPECT_THAT(refusal_of_gltf(glb.substr(0, 15)), HasSubstr("ends in its header"));
  glb[12] = 127;
  EXPECT_THAT(refusal_of_gltf(glb), HasSubstr("ends in its JSON part"));
}

TEST(GltfCheckTest, DamagedJsonIsRefusedByPosition) {
  EXPECT_THAT(refusal_of_gltf(R"({"nodes":[})"), HasSubstr("no JSON at byte 11"));
  EXPECT_THAT(refusal_of_gltf("{} {}"), HasSubstr("no JSON at byte"));
}

TEST(GltfCheckTest, DeepNestingIsRefusedWithoutRecursion) {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  EXPECT_EQ(check_gltf(deep).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of_gltf(deep),
            "the JSON part has deeper nesting, the limit gltf_depth is 64: export the file again");
}

TEST(GltfCheckTest, DeepTreesOfNodesAreRefused) {
  EXPECT_TRUE(check_gltf(chain(kMaxSceneDepth)).ok());
  EXPECT_EQ(refusal_of_gltf(chain(kMaxSceneDepth + 1)),
            "the scene has deeper nesting of nodes, the limit scene_depth is 256: flatten its nodes");
}

TEST(GltfCheckTest, NodesThatAreNotAForestAreRefused) {
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[0]})")), HasSubstr("a node contains itself"));
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[1]},{"children":[0]})")), HasSubstr("a node contains itself"));
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[1,1]},{})")), HasSubstr("node 1 has more than one parent"));
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[7]})")), HasSubstr("nodes[0].children names node 7 of 1"));
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[18446744073709551615]})")), HasSubstr("names node"));
}

TEST(GltfCheckTest, TooManyNodesAndChildrenAreRefused) {
  std::string nodes = "{}";
  for (size_t i = 0; i < kMaxSceneNodes; ++i) nodes += ",{}";
  EXPECT_EQ(refusal_of_gltf(nodes_of(nodes)),
            "the file has more nodes, the limit scene_nodes is 1048576: join its nodes");
  std::string children = "1";
  for (size_t i = 0; i < kMaxSceneNodes; ++i) children += ",1";
  EXPECT_THAT(refusal_of_gltf(nodes_of(R"({"children":[)" + children + "]},{}")), HasSubstr("the limit scene_nodes"));
}

TEST(GltfCheckTest, TooManyReferencesAreRefused) {
  std::string buffers;
  for (size_t i = 0; i <= kMaxReferencedFiles; ++i)
    buffers += (i > 0 ? "," : "") + (R"({"uri":")" + std::to_string(i)) + R"("})";
  EXPECT_THAT(refusal_of_gltf(R"({"buffers":[)" + buffers + "]}"), HasSubstr("the limit referenced_files is 256"));
}

TEST(GltfCheckTest, ReferencesThatLeadOutAreRefused) {
  for (const char* uri : {"/etc/passwd", "../a.bin", "a/../../b", "a/..", "%2e%2e/a", "..%2Fa", "%2Fetc/passwd",
                          "file:///etc/passwd", "http://host/a", "C:a", "a\\b", "a%00b", "a\nb", "", "%5C%5Chost"}) {
    const auto path = path_of_reference(uri);
    EXPECT_EQ(path.status().code(), absl::StatusCode::kInvalidArgument) << uri;
    EXPECT_THAT(std::string(path.status().message()), HasSubstr("no relative path below the file's folder"));
  }
  EXPECT_THAT(std::string(path_of_reference(std::string(2000, 'a')).status().message()),
              HasSubstr("the limit reference_bytes is 1024"));
}

TEST(GltfCheckTest, PercentsAreDecodedOnce) {
  EXPECT_EQ(path_of_reference("my%20file%2ebin").value(), "my file.bin");
  EXPECT_EQ(path_of_reference("100%").value(), "100%");
  EXPECT_EQ(path_of_reference("a%zz").value(), "a%zz");
  EXPECT_EQ(path_of_reference("%252e%252e/a").value(), "%2e%2e/a");
  EXPECT_EQ(path_of_reference("sub/dir/..a").value(), "sub/dir/..a");
}

TEST(GltfCheckTest, AFileWithoutBuffersIsFine) { EXPECT_THAT(check_gltf("{}").value(), IsEmpty()); }

TEST(GltfCheckTest, RandomMutationsNeverCrash) {
  SplitMix64 random(5);
  const std::string whole =
      R"({"nodes":[{"children":[1]},{}],"buffers":[{"uri":"a.bin"}],"meshes":[{"primitives":[]}]})";
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = whole;
    for (int i = 0; i < 2; ++i)
      bytes[random.below(static_cast<uint32_t>(bytes.size()))] = static_cast<char>(random.next());
    check_gltf(bytes).status().IgnoreError();
  }
}

}  // namespace
}  // namespace locus::cli
