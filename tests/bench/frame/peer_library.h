// Peer libraries, each with a flag that says whether this program was configured with it; and notes about missing
// libraries. Used by every suite. Plain data and pure functions.
#ifndef LOCUS_TESTS_BENCH_FRAME_PEER_LIBRARY_H_
#define LOCUS_TESTS_BENCH_FRAME_PEER_LIBRARY_H_

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"

namespace locus::bench {

struct PeerLibrary {
  const char* package;  // name of the Debian package
  bool is_here;
};

inline constexpr PeerLibrary kEmbree = {"libembree-dev", LOCUS_BENCH_EMBREE != 0};
inline constexpr PeerLibrary kBullet = {"libbullet-dev", LOCUS_BENCH_BULLET != 0};
inline constexpr PeerLibrary kBoost = {"libboost-dev", LOCUS_BENCH_BOOST != 0};
inline constexpr PeerLibrary kCgal = {"libcgal-dev", LOCUS_BENCH_CGAL != 0};
inline constexpr PeerLibrary kNanoflann = {"libnanoflann-dev", LOCUS_BENCH_NANOFLANN != 0};

// Returns one sentence for each library that was missing when this program was configured.
inline std::vector<std::string> missing_peers(absl::Span<const PeerLibrary> libraries) {
  std::vector<std::string> sentences;
  for (const PeerLibrary& library : libraries)
    if (!library.is_here)
      sentences.push_back(
          absl::StrCat("a peer is missing: ", library.package,
                       " was not installed when this program was configured; run deploy/packages.sh bench"));
  return sentences;
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_PEER_LIBRARY_H_
