// List of meshes for the static suite. If the options name meshes, these are used. Otherwise a quick run uses small
// meshes. Any other run uses generated meshes, from the size of the first-level cache to beyond the last-level cache,
// and two real levels if they were fetched.
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
