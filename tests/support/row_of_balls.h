// Fixture of tests that query a scene over gRPC: balls 1 to 4 of radius 1 at x = 3, 6, 9, 12, and a cube, instance 100,
// from x = 9 to 11.
#ifndef LOCUS_TESTS_SUPPORT_ROW_OF_BALLS_H_
#define LOCUS_TESTS_SUPPORT_ROW_OF_BALLS_H_

#include "tests/support/rpc_test.h"

namespace locus::test {

class RowOfBallsTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
    ASSERT_TRUE(change(place_one("cube", 100)).ok());
    ASSERT_TRUE(apply(insert_balls(1, 4)).ok());
  }

  v1::QueryResult ask(const v1::QueryBatch& batch) {
    v1::QueryResult result;
    const grpc::Status status = query(batch, &result);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return result;
  }
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ROW_OF_BALLS_H_
