#include "core/query/kinds/lookup_query.h"

#include <utility>

namespace locus {
namespace {

// Cost of finding an object through the list of its group, in visits of a scan of all objects.
constexpr size_t kListedCost = 8;

// Looks up an id by a scan of all objects and instances.
Hit scan_for(QueryTask& task, const SceneAtTime& moment, Id id) {
  Hit found;
  const auto is_last = [&](Id tested) {
    ++task.work().tests;
    return tested == id || !task.count_test();
  };
  moment.objects().grid().for_each([&](const GridRef& object) {
    const bool last = is_last(object.entry().id);
    if (object.entry().id == id) found = hit_on(object, 0, moment);
    return !last;
  });
  if (found.id == id) return found;
  for (const Instance& instance : moment.statics().tree().values()) {
    const bool last = is_last(instance.id);
    if (instance.id == id) return hit_on(instance, 0);
    if (last) break;
  }
  return {};
}

}  // namespace

Hit look_up(QueryTask& task, const SceneAtTime& moment, Id id) {
  if (task.brute_force()) return scan_for(task, moment, id);
  if (const GridRef object = moment.objects().find_ref(id)) return hit_on(object, 0, moment);
  if (const Instance* instance = moment.statics().find(id)) return hit_on(*instance, 0);
  return {};
}

absl::flat_hash_map<Group, OverlapAnswer> look_up_groups(QueryTask& task, const SceneAtTime& moment,
                                                         absl::Span<const uint64_t> groups,
                                                         const OverlapOptions& options) {
  absl::flat_hash_map<Group, LowestRows> rows;
  for (const Group group : groups) rows.emplace(group, LowestRows(options.max_results, false, options.count_only));
  const auto offer = [&](const auto& labels, const auto& make_hit) {
    ++task.work().tests;
    if (!task.count_test() || labels.id <= options.after_id) return;
    const auto group_rows = rows.find(labels.group);
    if (group_rows != rows.end()) group_rows->second.offer(make_hit());
  };
  for (const Instance& instance : moment.statics().tree().values())
    offer(instance, [&] { return hit_on(instance, 0); });
  const ObjectSet& objects = moment.objects();
  const auto visit = [&](const GridRef& object) {
    offer(object.entry(), [&] { return hit_on(object, 0, moment); });
    return !task.ended();
  };
  size_t members = 0;
  for (const auto& [group, lowest] : rows) members += objects.count_in(group);
  if (task.brute_force() || members * kListedCost >= objects.size()) {
    objects.grid().for_each(visit);
  } else {
    for (const auto& [group, lowest] : rows)
      if (!objects.for_each_in(group, visit)) break;
  }
  absl::flat_hash_map<Group, OverlapAnswer> answers;
  for (auto& [group, lowest] : rows) answers.emplace(group, lowest.finish());
  return answers;
}

}  // namespace locus
