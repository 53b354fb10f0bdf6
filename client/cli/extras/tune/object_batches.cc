#include "client/cli/extras/tune/object_batches.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::Status ObjectBatches::dump(const client::Client& client, const std::string& scene, uint64_t max_bytes,
                                 ProgressWriter& progress) {
  v1::DumpSceneRequest request;
  request.set_scene(scene);
  progress.begin({.action = "copying", .subject = scene, .unit = "objects"});
  uint64_t bytes = 0, items = 0;
  return client.dump(request, [&](const v1::DumpSceneResponse& message) {
    revision_ = message.revision();
    instances_.insert(instances_.end(), message.instances().begin(), message.instances().end());
    if (message.objects().empty()) return absl::OkStatus();
    uint64_t more = 0;
    for (const v1::Insert& run : message.objects()) {
      if (run.positions_f64_size() != 3 * run.ids_size())
        return absl::DataLossError("the dump came damaged: a column has another length than its ids");
      more += static_cast<uint64_t>(run.ids_size());
    }
    const bool lists_fit = !batches_.empty() && static_cast<uint64_t>(batches_.back().inserts_size()) +
                                                        static_cast<uint64_t>(message.objects_size()) <=
                                                    limits::kMaxUpdateLists;
    if (!lists_fit || bytes + message.ByteSizeLong() > max_bytes || items + more > limits::kMaxUpdateItems) {
      batches_.emplace_back();
      bytes = items = 0;
    }
    for (const v1::Insert& run : message.objects()) {
      v1::Insert& insert = *batches_.back().add_inserts();
      insert = run;
      insert.clear_expire_ticks();  // the ticks of a scratch scene stand still
    }
    bytes += message.ByteSizeLong();
    items += more;
    objects_ += more;
    progress.update(objects_);
    return absl::OkStatus();
  });
}

v1::UpdateBatch ObjectBatches::move_first(bool away) const {
  LOCUS_CHECK_NE(objects_, 0u);
  const v1::Insert& first = batches_.front().inserts(0);
  v1::UpdateBatch batch;
  v1::Move& move = *batch.add_moves();
  move.add_ids(first.ids(0));
  const double x = first.positions_f64(0);
  move.add_positions_f64(away ? x + (x > 0 ? -1 : 1) : x);
  move.add_positions_f64(first.positions_f64(1));
  move.add_positions_f64(first.positions_f64(2));
  return batch;
}

std::vector<std::array<double, 3>> ObjectBatches::positions(uint64_t count) const {
  const uint64_t stride = std::max<uint64_t>(1, (objects_ + count - 1) / std::max<uint64_t>(count, 1));
  std::vector<std::array<double, 3>> positions;
  uint64_t passed = 0;
  for (const v1::UpdateBatch& batch : batches_) {
    for (const v1::Insert& run : batch.inserts()) {
      for (int row = 0; row < run.ids_size(); ++row) {
        if (passed++ % stride != 0 || positions.size() >= count) continue;
        positions.push_back(
            {run.positions_f64(3 * row), run.positions_f64(3 * row + 1), run.positions_f64(3 * row + 2)});
      }
    }
  }
  return positions;
}

}  // namespace locus::cli
