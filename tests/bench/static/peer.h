// The one interface of locus and of every peer: all get the same queries in the same columns, and write answers into
// buffers of the caller. A peer is built by its constructor from a mesh that must outlive it. Only one thread may use a
// peer at a time, but any number may use locus.
#ifndef LOCUS_TESTS_BENCH_STATIC_PEER_H_
#define LOCUS_TESTS_BENCH_STATIC_PEER_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "tests/bench/static/workload.h"

namespace locus::bench {

inline constexpr uint32_t kNoTriangle = 0xFFFFFFFFu;
inline constexpr size_t kSpareIds = 65'536;

struct RayAnswer {
  float t = 0;  // t of the hit; meaningless for a miss
  uint32_t triangle = kNoTriangle;
};

// Kind of query that a case measures.
enum class Task : uint8_t { kFirst, kFirstOfCamera, kAny, kAll, kBall, kBox };

class Peer {
 public:
  explicit Peer(std::string name) : name_(std::move(name)) {}
  virtual ~Peer() = default;
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  const std::string& name() const { return name_; }
  virtual bool does(Task task) const = 0;
  // Returns whether the peer gets only an eighth of the queries, 16 of each 128.
  virtual bool slow() const { return false; }
  // Returns the reason why some answers of this peer are known to be wrong; empty = all answers should be right.
  virtual std::string known_fault(Task) const { return ""; }

  // Answer rays: first() writes the first hit, any() writes whether there is a hit. The second argument has one entry
  // for each ray. Each function below is called only if does() returns true for its task.
  virtual void first(absl::Span<const RayQuery>, RayAnswer*) {}
  virtual void any(absl::Span<const RayQuery>, uint8_t*) {}
  // Writes to `ids` the numbers of all triangles that each ray, ball or box reaches, in any order, and to `counts` how
  // many triangles each query reaches. `ids` has room for the numbers of all triangles of the mesh and kSpareIds more.
  // A peer may write from the start of `ids` again when `ids` is full, or at each new query. Therefore all numbers are
  // sure to be in `ids`, from its start, only after a call with one query.
  virtual void ray_ids(absl::Span<const RayQuery>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}
  virtual void ball_ids(absl::Span<const Ballf>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}
  virtual void box_ids(absl::Span<const Obbf>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}

 private:
  const std::string name_;
};

using Peers = std::vector<std::unique_ptr<Peer>>;

// Structures that the selected cases need: `rays` for first and any hits, `regions` for all triangles of a ray, ball or
// box. Structures that no case needs are not built.
struct Needs {
  bool rays = false;
  bool regions = false;
};

// Interface of a contestant that builds a tree, for the cases build and memory.
class Builder {
 public:
  explicit Builder(std::string name) : name_(std::move(name)) {}
  virtual ~Builder() = default;
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  const std::string& name() const { return name_; }
  // Releases the previous tree; runs while the clock is stopped.
  virtual void prepare() = 0;
  virtual void build() = 0;
  // Returns the bytes that stay resident after a build().
  virtual uint64_t bytes() = 0;

 private:
  const std::string name_;
};

// Returns the bounds of a query's box, for peers that take bounds.
inline Aabbf ends_of(const Obbf& box) { return {box.center - box.half, box.center + box.half}; }

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_PEER_H_
