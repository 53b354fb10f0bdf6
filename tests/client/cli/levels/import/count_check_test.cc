#include "client/cli/levels/import/count_check.h"

#include <gtest/gtest.h>

#include "client/cli/levels/import/import_limits.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

TEST(CountCheckTest, LinesOfAnObjFileAreCountedByTheirFirstWord) {
  const ElementCounts counts = count_obj("# v 1\nv 0 0 0\n  v 1 0 0\r\nvn 0 0 1\nvt 0 0\nf 1 2 3\nf\nfoo 1\nf 1 2 3 4");
  EXPECT_EQ(counts.vertices, 2u);
  EXPECT_EQ(counts.triangles, 2u);
}

TEST(CountCheckTest, ABinaryStlDeclaresItsTriangles) {
  std::string binary(80, 's');
  append_u32(binary, 2);
  binary.append(100, '\0');
  EXPECT_EQ(count_stl(binary).triangles, 2u);
  EXPECT_EQ(count_stl(binary).vertices, 6u);
}

TEST(CountCheckTest, FacetsOfATextStlAreCounted) {
  EXPECT_EQ(count_stl("solid s\n facet normal 0 0 1\nendfacet\nfacet normal 0 0 1\nendsolid").triangles, 2u);
}

TEST(CountCheckTest, TheExceededLimitIsNamed) {
  EXPECT_TRUE(check_counts({kMaxImportVertices, kMaxImportTriangles}).ok());
  EXPECT_EQ(check_counts({0, kMaxImportTriangles + 1}),
            absl::ResourceExhaustedError(
                "the file has 134217729 triangles, the limit triangles is 134217728: split it into several files"));
  EXPECT_EQ(check_counts({kMaxImportVertices + 1, 0}),
            absl::ResourceExhaustedError(
                "the file has 402653185 vertices, the limit vertices is 402653184: split it into several files"));
}

}  // namespace
}  // namespace locus::cli
