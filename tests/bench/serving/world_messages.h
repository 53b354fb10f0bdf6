// Messages for a server with the objects and moves of a world of the dynamic suite. Used by cases that move objects.
// Stateless functions.
#ifndef LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_
#define LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_

#include <string>
#include <vector>

#include "locus/v1/update_service.pb.h"
#include "tests/bench/dynamic/world.h"

namespace locus::bench::serving {

// Returns a batch that inserts all objects of the world as balls.
v1::UpdateBatch insert_all(const dynamic::World& world);

// Advances the world by `ticks` ticks and returns their moves in messages of `size` moves; the last message of a tick
// may have fewer.
std::vector<v1::StreamUpdatesRequest> move_messages(dynamic::World& world, const std::string& scene, size_t size,
                                                    size_t ticks);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_WORLD_MESSAGES_H_
