// A minimal mesh that the tests of this suite share: two triangles, one above the other.
#ifndef LOCUS_TESTS_BENCH_STATIC_TWO_SHEETS_H_
#define LOCUS_TESTS_BENCH_STATIC_TWO_SHEETS_H_

#include "tests/bench/static/bench_mesh.h"

namespace locus::bench {

inline BenchMesh two_sheets() {
  cli::ImportedMesh mesh;
  mesh.vertices = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 3, 4, 0, 3, 0, 4, 2};
  mesh.indices = {0, 1, 2, 3, 4, 5};
  return *bench_mesh("sheets", {mesh});
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_TWO_SHEETS_H_
