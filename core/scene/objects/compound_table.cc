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
    owners_.set(use.index, compound->shared_from_this());
    changed_ = true;
  }
  ++use.objects;
}

size_t CompoundTable::remove(const Compound* compound) {
  if (compound == nullptr) return 0;
  const auto at = uses_.find(compound);
  LOCUS_CHECK(at != uses_.end());
  if (--at->second.objects != 0) return 0;
  const size_t bytes = compound->bytes();
  free_indices_.push_back(at->second.index);
  owners_.set(at->second.index, nullptr);  // may destroy the compound
  uses_.erase(at);
  changed_ = true;
  return bytes;
}

std::shared_ptr<const CompoundArray> CompoundTable::snapshot() {
  if (changed_) snapshot_ = uses_.empty() ? nullptr : std::make_shared<const CompoundArray>(owners_.snapshot());
  changed_ = false;
  return snapshot_;
}

}  // namespace locus
