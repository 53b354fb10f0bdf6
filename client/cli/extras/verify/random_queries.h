// Random query batches of `locus verify`: a block of every kind, inside the bounds of a scene and close around them.
// Equal seeds and scenes give equal batches. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_VERIFY_RANDOM_QUERIES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_VERIFY_RANDOM_QUERIES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/lib/client.h"
#include "client/lib/query_builder.h"

namespace locus::cli {

class RandomQueries {
 public:
  // Maximum number of objects for which next() also asks for pairs: by list, one query of pairs tests each object
  // against each other object.
  static constexpr uint64_t kMaxPairedObjects = 300;  // --help names it

  RandomQueries(const v1::Scene& scene, uint64_t seed);

  // Returns a batch with a block of every kind and about `queries` queries in each block, without a view. Some blocks
  // filter by layers, search only objects or only instances, use bounds (CONSERVATIVE), or ask about the past if the
  // scene has one.
  v1::QueryBatch next(uint32_t queries);

  bool asks_pairs() const { return objects_ <= kMaxPairedObjects; }
  // Remembers ids of an answer, which later batches look up.
  void learn_ids(const v1::QueryResult& result);

 private:
  double unit() { return random_.unit(); }
  bool chance(double probability) { return unit() < probability; }
  // Returns a random point relative to the frame, in the scene or up to a tenth of its size beside it.
  client::Float3 place();
  std::vector<float> places(uint32_t count);
  // Returns random lengths; small and large ones are equally likely.
  float length();
  std::vector<float> lengths(uint32_t count);
  // Returns a vector of a random direction and of length() times `scale`.
  client::Float3 way(float scale);
  client::Rotation rotation();
  v1::StaticDetail detail();
  v1::RayMode mode();

  // Sets the settings that all kinds have, and `columns`. Call it after the queries are added, since it sets whole
  // columns.
  template <class Block>
  void settle(Block& block, std::vector<v1::Column> columns);
  void add_lines(client::QueryBuilder& builder, uint32_t queries);
  void add_solids(client::QueryBuilder& builder, uint32_t queries);
  void add_regions(client::QueryBuilder& builder, uint32_t queries);
  void add_points(client::QueryBuilder& builder, uint32_t queries);

  SplitMix64 random_;
  client::Double3 frame_;  // middle of the scene
  client::Float3 half_;    // half of its size, never 0
  float size_ = 1;         // largest edge of its bounds
  uint64_t objects_ = 0;
  uint64_t oldest_tick_ = 0;  // ticks from here to tick_ can be queried
  uint64_t tick_ = 0;
  std::vector<uint64_t> ids_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_VERIFY_RANDOM_QUERIES_H_
