#include "core/scene/objects/compound_table.h"

#include "core/base/check.h"

namespace locus {

size_t unshared_bytes(const std::shared_ptr<const CompoundArray>& compounds,
                      const std::shared_ptr<const CompoundArray>& other) {
  if (compounds == nullptr || compounds == other) return 0;
  const CompoundArray none;
  const CompoundArray& theirs = other == nullptr ? none : *other;
  size_t bytes = compounds->unshared_bytes(theirs);
  compounds->for_each_apart_from(theirs, [&bytes](const CompoundPtr& compound, const CompoundPtr* known) {
    if (compound != nullptr && (known == nullptr || *known != compound)) bytes += compound->bytes();
  });
  return bytes;
}

void CompoundTable::set_owner(uint32_t index, CompoundPtr owner) {
  const size_t leaves = (owners_.size() + kOwnersPerLeaf - 1) / kOwnersPerLeaf;
  const size_t leaf = index / kOwnersPerLeaf;
  // The last snapshot shares no leaf that is new, and nothing if it has no compounds.
  const bool is_shared = snapshot_ != nullptr && leaf < leaves;
  owners_.set(index, std::move(owner));
  if (snapshot_ == nullptr || !changed_leaves_.insert(leaf).second) return;
  if (is_shared) replaced_bytes_ += kOwnersPerLeaf * sizeof(CompoundPtr) + sizeof(uint64_t);
  if (changed_leaves_.size() == 1) replaced_bytes_ += leaves * sizeof(std::shared_ptr<void>);
}

void CompoundTable::add(const Compound* compound) {
  if (compound == nullptr) return;
  const auto [at, is_new] = uses_.try_emplace(compound);
  Use& use = at->second;
  if (is_new) {
    use = {static_cast<uint32_t>(owners_.size()), 0};
    if (!free_indices_.empty()) {
      use.index = free_indices_.back();
      free_indices_.pop_back();
    }
    set_owner(use.index, compound->shared_from_this());
    changed_ = true;
  }
  ++use.objects;
}

void CompoundTable::remove(const Compound* compound) {
  if (compound == nullptr) return;
  const auto at = uses_.find(compound);
  LOCUS_CHECK(at != uses_.end());
  if (--at->second.objects != 0) return;
  replaced_bytes_ += compound->bytes();
  free_indices_.push_back(at->second.index);
  set_owner(at->second.index, nullptr);  // may destroy the compound
  uses_.erase(at);
  changed_ = true;
}

std::shared_ptr<const CompoundArray> CompoundTable::snapshot() {
  if (changed_) changed_leaves_.clear();
  if (changed_) snapshot_ = uses_.empty() ? nullptr : std::make_shared<const CompoundArray>(owners_.snapshot());
  changed_ = false;
  return snapshot_;
}

}  // namespace locus
