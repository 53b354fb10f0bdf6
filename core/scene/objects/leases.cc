#include "core/scene/objects/leases.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus {

void Leases::begin(uint64_t writer, uint32_t lease_ms) {
  LOCUS_DCHECK(writer != 0 && lease_ms != 0);
  uint32_t& length = leases_[writer];
  if (length != lease_ms) ++changes_;
  length = lease_ms;
  LOCUS_DCHECK_LE(leases_.size(), size_t{limits::kMaxLeases});
}

void Leases::end(uint64_t writer) {
  LOCUS_DCHECK_EQ(objects_.count(writer), 0u);
  changes_ += leases_.erase(writer);
}

void Leases::give(uint32_t handle, uint64_t writer) {
  const uint64_t before = owner(handle);
  if (before == writer) return;
  if (handle >= owners_.size()) owners_.resize(size_t{handle} + 1);
  objects_.remove(before, handle);
  objects_.add(writer, handle);
  owners_[handle] = writer;
}

std::vector<Lease> Leases::list() const {
  std::vector<Lease> leases;
  leases.reserve(leases_.size());
  for (const auto& [writer, lease_ms] : leases_) leases.push_back({writer, lease_ms});
  std::sort(leases.begin(), leases.end(), [](const Lease& a, const Lease& b) { return a.writer < b.writer; });
  return leases;
}

LeaseTable Leases::table() { return {list(), objects_.snapshot()}; }

}  // namespace locus
