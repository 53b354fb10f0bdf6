// List of meshes for the static suite: those named in the options, small ones, or its own from first-level cache size
// to beyond the last, with two real levels if they were fetched.
#ifndef LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_
#define LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_

#include <string>
#include <vector>

#include "tests/bench/frame/options.h"

namespace locus::bench {

// Returns names for load_mesh(). Adds a note for each level that is not in the folder of `options`.
std::vector<std::string> meshes_of(const Options& options, std::vector<std::string>& notes);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_MESH_LIST_H_
