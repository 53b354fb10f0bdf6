// The words for a peer that is not there. For every suite.
#ifndef LOCUS_TESTS_BENCH_FRAME_MISSING_PEER_H_
#define LOCUS_TESTS_BENCH_FRAME_MISSING_PEER_H_

#include <string>

#include "absl/strings/str_cat.h"

namespace locus::bench {

// `package`: Debian's, without which this program was configured.
inline std::string missing_peer(const std::string& package) {
  return absl::StrCat("a peer is missing: ", package,
                      " was not installed when this program was configured; run deploy/packages.sh bench");
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_MISSING_PEER_H_
