// Byte-for-byte comparison of the arrays that store two trees over the triangles of a mesh.
#ifndef LOCUS_TESTS_SUPPORT_EQUAL_TREES_H_
#define LOCUS_TESTS_SUPPORT_EQUAL_TREES_H_

#include <gtest/gtest.h>

#include <cstring>

#include "core/index/bvh/triangle_bvh.h"

namespace locus::test {

namespace internal {

template <class T>
bool equal_bytes(const T* a, const T* b, size_t count) {
  return std::memcmp(a, b, count * sizeof(T)) == 0;
}

}  // namespace internal

// Expects that the arrays of both trees are equal byte for byte. Neither tree may be empty.
inline void expect_equal_bytes(const TriangleBvh& a, const TriangleBvh& b) {
  ASSERT_EQ(a.node_count(), b.node_count());
  ASSERT_EQ(a.block_count(), b.block_count());
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.depth(), b.depth());
  EXPECT_EQ(a.bounds(), b.bounds());
  EXPECT_EQ(a.tree().magnitude, b.tree().magnitude);
  EXPECT_TRUE(internal::equal_bytes(a.tree().nodes, b.tree().nodes, a.node_count()));
  EXPECT_TRUE(internal::equal_bytes(a.tree().ranges, b.tree().ranges, a.node_count()));
  EXPECT_TRUE(internal::equal_bytes(a.tree().blocks, b.tree().blocks, a.block_count()));
  EXPECT_TRUE(internal::equal_bytes(a.tree().numbers, b.tree().numbers, a.size()));
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_EQUAL_TREES_H_
