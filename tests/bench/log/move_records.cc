#include "tests/bench/log/move_records.h"

#include "core/scene/log/record_codec.h"
#include "tests/bench/dynamic/world.h"

namespace locus::bench::log {

std::vector<std::string> move_records(size_t moves, size_t count) {
  constexpr uint32_t kObjects = 100'000;
  dynamic::World world(dynamic::Kind::kUniform, kObjects);
  std::vector<std::string> records(count);
  size_t first = kObjects;
  for (std::string& record : records) {
    if (first + moves > kObjects) {
      world.step();
      first = 0;
    }
    MoveColumns columns;
    columns.ids = world.moves().ids.subspan(first, moves);
    columns.positions = world.moves().positions.subspan(3 * first, 3 * moves);
    UpdateBatch batch;
    batch.moves.push_back(columns);
    encode_batch(batch, record);
    first += moves;
  }
  return records;
}

}  // namespace locus::bench::log
