// A structure of core/index as a contestant: boxes are filed in it, and queries are counted and hashed. One thread.
#ifndef LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURE_H_
#define LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURE_H_

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/index/work.h"
#include "tests/bench/structures/scenes.h"

namespace locus::bench::structures {

enum class QueryName : uint8_t { kRay, kRayShort, kAny, kBall, kBox, kNearest };
inline constexpr std::array<QueryName, 6> kQueryNames = {QueryName::kRay,  QueryName::kRayShort, QueryName::kAny,
                                                         QueryName::kBall, QueryName::kBox,      QueryName::kNearest};
const char* name_of(QueryName query);
inline constexpr size_t kNearestCount = 8;

class Structure {
 public:
  Structure() = default;
  virtual ~Structure() = default;
  Structure(const Structure&) = delete;
  Structure& operator=(const Structure&) = delete;

  // Files all boxes, in place of those that the structure has.
  virtual void build(const std::vector<Object>& boxes) = 0;
  // Returns whether insert() and remove() may be called.
  virtual bool changes() const = 0;
  virtual void insert(const Object& box) = 0;
  virtual void remove(const Object& box) = 0;
  // Answers the query with the index `number`. Returns a hash of its results, which does not depend on their order, and
  // adds its cost to `work`.
  virtual uint64_t answer(QueryName query, const SceneQueries& queries, size_t number, Work& work) const = 0;
};

struct NamedStructure {
  std::string name;
  std::function<std::unique_ptr<Structure>()> make;
};
// Returns the structures in the order of the table. The first is the list, which every other one is compared with.
std::vector<NamedStructure> structures();

}  // namespace locus::bench::structures

#endif  // LOCUS_TESTS_BENCH_STRUCTURES_STRUCTURE_H_
