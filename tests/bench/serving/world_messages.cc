#include "tests/bench/serving/world_messages.h"

namespace locus::bench::serving {

v1::UpdateBatch insert_all(const dynamic::World& world) {
  v1::UpdateBatch batch;
  v1::Insert* const insert = batch.add_inserts();
  const dynamic::Objects objects = world.objects();
  insert->mutable_ids()->Add(objects.ids.begin(), objects.ids.end());
  insert->mutable_positions()->Add(objects.positions.begin(), objects.positions.end());
  insert->mutable_ball()->mutable_radii()->Add(objects.radii.begin(), objects.radii.end());
  return batch;
}

std::vector<v1::StreamUpdatesRequest> move_messages(dynamic::World& world, const std::string& scene, size_t size,
                                                    size_t ticks) {
  std::vector<v1::StreamUpdatesRequest> messages;
  for (size_t tick = 0; tick < ticks; ++tick) {
    world.step();
    const dynamic::Moves moves = world.moves();
    for (size_t first = 0; first < moves.ids.size(); first += size) {
      const auto ids = moves.ids.subspan(first, size);
      const auto positions = moves.positions.subspan(3 * first, 3 * ids.size());
      v1::StreamUpdatesRequest& message = messages.emplace_back();
      message.set_scene(scene);
      v1::Move* const move = message.mutable_batch()->add_moves();
      move->mutable_ids()->Add(ids.begin(), ids.end());
      move->mutable_positions()->Add(positions.begin(), positions.end());
    }
  }
  return messages;
}

}  // namespace locus::bench::serving
