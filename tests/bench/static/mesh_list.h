// Which meshes the static suite runs over: those asked for, small ones, or its own from the first cache to beyond the
// last, with two real levels where they were fetched.
#ifndef LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_
#define LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_

#include <string>
#include <vector>

#include "tests/bench/frame/options.h"

namespace locus::bench {

// Names for load_mesh(). A note for each level that is not in the folder of `options`.
std::vector<std::string> meshes_of(const Options& options, std::vector<std::string>& notes);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_
