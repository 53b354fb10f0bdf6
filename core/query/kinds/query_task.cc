#include "core/query/kinds/query_task.h"

#include <utility>

#include "core/base/planted_bug.h"
#include "core/query/kinds/object_boxes.h"

namespace locus {

bool Filter::passes_rare_filters(Group group, Tag tag, Id id) const {
  if (planted(PlantedBug::kFilterLabels)) return true;
  const QueryBlock& block = *block_;
  if (std::find(block.ignore_ids.begin(), block.ignore_ids.end(), id) != block.ignore_ids.end()) return false;
  if (ColumnReader<uint64_t>(block.self_ids, 1).value(query_, kNoId) == id) return false;
  if (!block.tags.empty()) {
    Tag mask = ColumnReader<uint64_t>(block.tag_masks, 1).value(query_, ~Tag{0});
    if (planted(PlantedBug::kFilterTagMask)) mask = ~Tag{0};
    if (((tag ^ *ColumnReader<uint64_t>(block.tags, 1).entry(query_)) & mask) != 0) return false;
  }
  if (block.only_groups.empty()) return true;
  const size_t groups = planted(PlantedBug::kFilterFirstGroup) ? 1 : block.only_groups_per_query();
  const ColumnReader<uint64_t> reader(block.only_groups, block.only_groups_per_query());
  const absl::Span<const uint64_t> wanted(reader.entry(query_), groups);
  if (group != 0 && std::find(wanted.begin(), wanted.end(), group) != wanted.end()) return true;
  return std::all_of(wanted.begin(), wanted.end(), [](uint64_t one) { return one == 0; });
}

BatchControl::BatchControl(uint64_t max_work, std::function<absl::Status()> stop)
    : max_work_(max_work), stop_(std::move(stop)) {}

BatchControl::~BatchControl() = default;

const ObjectBoxes* BatchControl::object_boxes(const ObjectSet& objects, size_t rays) {
  const ObjectBoxes* const boxes = boxes_.load(std::memory_order_acquire);
  if (boxes != nullptr) return boxes;
  const uint64_t enough = objects.size() / 2, before = beam_rays_.fetch_add(rays, std::memory_order_relaxed);
  if (before > enough || before + rays <= enough) return nullptr;  // another thread builds them, or not yet
  built_boxes_ = std::make_unique<const ObjectBoxes>(objects);
  boxes_.store(built_boxes_.get(), std::memory_order_release);
  return built_boxes_.get();
}

bool BatchControl::report_work(uint64_t work) {
  done_.fetch_add(work, std::memory_order_relaxed);
  if (stopped() || out_of_work()) return false;
  if (!stop_) return true;
  absl::Status status = stop_();
  if (status.ok()) return true;
  if (!stopping_.exchange(true)) {
    LOCUS_DCHECK(!stopped());
    status_ = std::move(status);
    stopped_.store(true, std::memory_order_release);
  }
  return false;
}

bool QueryTask::check() {
  const uint64_t done = work_.nodes + work_.cells + work_.tests;
  LOCUS_DCHECK_GE(done, reported_work_);
  ended_ = ended_ || !control_.report_work(done - reported_work_);
  reported_work_ = done;
  return !ended_;
}

}  // namespace locus
