// The one interface of locus and of every peer: the same queries in the same columns, answers into buffers of the
// caller. A peer is made from a mesh, which must outlive it, and is then ready. One thread uses a peer at a time,
// except locus.
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
  float t = 0;  // t of a hit
  uint32_t triangle = kNoTriangle;
};

// Kind of query of a case.
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
  // Returns the reason why some of its answers are known to be wrong; empty = all should be right.
  virtual std::string known_fault(Task) const { return ""; }

  // Answers queries; `answers` has one entry for each ray. Only functions whose task does() supports are called.
  virtual void first(absl::Span<const RayQuery>, RayAnswer*) {}
  virtual void any(absl::Span<const RayQuery>, uint8_t*) {}
  // Writes the numbers of all triangles that each ray, ball or box reaches, in any order, to `ids`, from its start
  // again if it is full or the peer works query by query; `ids` has room for all triangles of the mesh and kSpareIds
  // more. A call with one query leaves that query's numbers at the start. Sets `counts` to the number of ids of each
  // query.
  virtual void ray_ids(absl::Span<const RayQuery>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}
  virtual void ball_ids(absl::Span<const Ballf>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}
  virtual void box_ids(absl::Span<const Obbf>, absl::Span<uint32_t> /*ids*/, uint32_t* /*counts*/) {}

 private:
  const std::string name_;
};

using Peers = std::vector<std::unique_ptr<Peer>>;

// Structures that the selected cases need: for hits of rays, and for all triangles of a ray, ball or box. Others are
// not built.
struct Needs {
  bool rays = false;
  bool regions = false;
};

// Interface of building, for the cases build and memory.
class Builder {
 public:
  explicit Builder(std::string name) : name_(std::move(name)) {}
  virtual ~Builder() = default;
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  const std::string& name() const { return name_; }
  // Runs before the clock starts.
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
