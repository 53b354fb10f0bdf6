#include "core/query/lookup_query.h"

#include <utility>

namespace locus {

Hit look_up(const SceneSnapshot& snapshot, Id id) {
  if (const Object* object = snapshot.objects.find(id)) return hit_on(*object, 0);
  if (const Instance* instance = snapshot.statics->find(id)) return hit_on(*instance, 0);
  return {};
}

absl::flat_hash_map<Group, OverlapAnswer> look_up_groups(QueryTask& task, absl::Span<const uint64_t> groups,
                                                         const OverlapOptions& options) {
  absl::flat_hash_map<Group, LowestRows> rows;
  for (const Group group : groups) rows.emplace(group, LowestRows(options.max_results, false));
  const auto offer = [&](const auto& item) {
    ++task.work().tests;
    if (!task.count_test() || item.id <= options.after_id) return;
    const auto wanted = rows.find(item.group);
    if (wanted != rows.end()) wanted->second.offer(hit_on(item, 0));
  };
  for (const Instance& instance : task.snapshot().statics->tree().values()) offer(instance);
  task.snapshot().objects.for_each([&](Id, const Object& object) { offer(object); });
  absl::flat_hash_map<Group, OverlapAnswer> answers;
  for (auto& [group, lowest] : rows) answers.emplace(group, lowest.finish());
  return answers;
}

}  // namespace locus
