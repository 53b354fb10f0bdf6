#include "core/scene/objects/group_lists.h"

namespace locus {

GroupLists GroupLists::snapshot() {
  GroupLists lists;
  lists.index_ = index_.snapshot();
  lists.lists_ = lists_.snapshot();
  lists.links_ = links_.snapshot();
  return lists;
}

void GroupLists::add(Group group, uint32_t handle) {
  if (group == 0) return;
  uint32_t list = index_.find(group);
  if (list == kNone) {
    list = static_cast<uint32_t>(lists_.size());
    if (!free_lists_.empty()) {
      list = free_lists_.back();
      free_lists_.pop_back();
    }
    index_.set(group, list);
    lists_.set(list, {});
  }
  const List before = lists_[list];
  links_.set(handle, {before.first, kNone});
  if (before.first != kNone) links_.set(before.first, {links_[before.first].next, handle});
  lists_.set(list, {handle, before.count + 1});
}

void GroupLists::remove(Group group, uint32_t handle) {
  if (group == 0) return;
  const uint32_t list = index_.find(group);
  LOCUS_CHECK_NE(list, kNone);
  const List before = lists_[list];
  const Link removed = links_[handle];
  LOCUS_DCHECK_EQ(removed.previous == kNone, before.first == handle);
  if (removed.next != kNone) links_.set(removed.next, {links_[removed.next].next, removed.previous});
  if (removed.previous != kNone) links_.set(removed.previous, {removed.next, links_[removed.previous].previous});
  links_.set(handle, {});
  lists_.set(list, {before.first == handle ? removed.next : before.first, before.count - 1});
  if (before.count > 1) return;
  index_.erase(group);
  index_.fit(index_.size());
  free_lists_.push_back(list);
}

}  // namespace locus
