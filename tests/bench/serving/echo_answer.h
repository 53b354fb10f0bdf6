// Answer of the echo server: 24 bytes a ray, copied from the columns of the request, so that the answer costs little.
// Used by the echo server, and by the benchmark, which verifies its answers. Pure function.
#ifndef LOCUS_TESTS_BENCH_SERVING_ECHO_ANSWER_H_
#define LOCUS_TESTS_BENCH_SERVING_ECHO_ANSWER_H_

#include "locus/v1/query_service.pb.h"

namespace locus::bench::serving {

// Answers the batch's first block, which must have one t_max and one mask for each ray.
inline void answer_echo(const v1::QueryBatch& batch, v1::QueryResult& result) {
  result.Clear();
  v1::BlockResult& block = *result.add_blocks();
  const v1::QueryBlock& asked = batch.blocks(0);
  const google::protobuf::RepeatedField<float>& origins = asked.rays().origins();
  const int rays = asked.masks_size();
  *block.mutable_t() = asked.rays().t_max();
  *block.mutable_triangles() = asked.masks();
  block.mutable_uvs()->Add(origins.begin(), origins.begin() + 2 * rays);
  block.mutable_ids()->Reserve(rays);
  for (int ray = 0; ray < rays; ++ray) block.mutable_ids()->AddAlreadyReserved(static_cast<uint64_t>(ray));
}

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_ECHO_ANSWER_H_
