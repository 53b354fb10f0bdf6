// Records of batches of moves, as a scene appends them to its log. Plain function; any thread.
#ifndef LOCUS_TESTS_BENCH_LOG_MOVE_RECORDS_H_
#define LOCUS_TESTS_BENCH_LOG_MOVE_RECORDS_H_

#include <cstddef>
#include <string>
#include <vector>

namespace locus::bench::log {

// Returns `count` records, each with `moves` moves of the 100,000 objects of a uniform world.
std::vector<std::string> move_records(size_t moves, size_t count);

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_MOVE_RECORDS_H_
