// A world of the dynamic suite as messages for a server. For cases that move objects. Plain functions.
#ifndef LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_
#define LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_

#include <string>
#include <vector>

#include "locus/v1/update_service.pb.h"
#include "tests/bench/dynamic/world.h"

namespace locus::bench::serving {

// Returns inserts of all objects, as balls.
v1::UpdateBatch insert_all(const dynamic::World& world);

// Returns moves of `ticks` ticks in messages of `size`; the last of a tick may have fewer.
std::vector<v1::StreamUpdatesRequest> move_messages(dynamic::World& world, const std::string& scene, size_t size,
                                                    size_t ticks);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_
