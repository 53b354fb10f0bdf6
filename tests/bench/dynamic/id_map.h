// Map from ids to indices, which a caller needs if a library has indices but no ids. Indices of removed ids are used
// again. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_ID_MAP_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_ID_MAP_H_

#include <vector>

#include "absl/container/flat_hash_map.h"
#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

class IdMap {
 public:
  // Assigns the indices 0, 1, 2 ... to `ids`.
  explicit IdMap(absl::Span<const uint64_t> ids) {
    numbers_.reserve(ids.size());
    for (const uint64_t id : ids) numbers_.emplace(id, static_cast<uint32_t>(numbers_.size()));
  }
  uint32_t number_of(uint64_t id) const { return numbers_.find(id)->second; }
  uint32_t remove(uint64_t id) {
    const auto at = numbers_.find(id);
    free_.push_back(at->second);
    numbers_.erase(at);
    return free_.back();
  }
  // Inserts an id and returns its index. At least one index of a removed id must be free.
  uint32_t insert(uint64_t id) {
    const uint32_t number = free_.back();
    free_.pop_back();
    numbers_.emplace(id, number);
    return number;
  }

 private:
  absl::flat_hash_map<uint64_t, uint32_t> numbers_;
  std::vector<uint32_t> free_;
};

// Object of a contender that stores its objects in an array. IdMap translates an id to the index in this array.
struct Body {
  Vec3f position;
  float radius = 0;
  uint64_t id = 0;
};

inline Body body_at(const Objects& objects, size_t i) {
  return {point_at(objects.positions, i), objects.radii[i], objects.ids[i]};
}

inline std::vector<Body> bodies_of(const Objects& objects) {
  std::vector<Body> bodies(objects.ids.size());
  for (size_t i = 0; i < bodies.size(); ++i) bodies[i] = body_at(objects, i);
  return bodies;
}

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_ID_MAP_H_
