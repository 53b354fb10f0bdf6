// Implementation of the ray kernels, compiled once for each instruction set by the .cc file that includes it. Up to 32
// rays are traced interleaved, one step each in turn, which hides memory latency: while one ray waits for memory, the
// others continue. Steps of the same kind are executed together for all rays whose next step is of that kind, so that
// the processor seldom mispredicts a branch; a misprediction costs more than a step.
//
// Sources: Wald, Benthin, Boulos, Getting Rid of Packets, 2008 (single rays in wide trees); Kocberber, Falsafi, Grot,
// Asynchronous Memory Access Chaining, 2015 (many searches interleaved).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_answer_impl.h"
#include "core/index/bvh/kernels/ray_beam_impl.h"
#include "core/index/bvh/kernels/ray_block_impl.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/ray_packet_impl.h"
#include "core/index/bvh/kernels/ray_setup_impl.h"

namespace locus {
namespace {

constexpr uint32_t kMaxFlights = 32;  // maximum number of rays traced interleaved
constexpr uint32_t kMaxPackets = 2;   // maximum number of packets traced interleaved
// Maximum number of rays that are prepared together. The index of a prepared ray fits in a byte.
constexpr uint32_t kPreparedRays = 256;
static_assert(kPreparedRays <= 256 && kPreparedRays % kTreeWidth == 0 && kMaxFlights <= 256);

// Ray being traced. `waiting` is a stack of child slot values: the nodes and blocks that the ray enters at or before
// its limit. The lowest element of `waiting` is the sentinel kNoChild. nears[i] is the t at which the ray enters
// waiting[i]; unused if kAny.
struct alignas(64) InFlightRay {
  PreparedRay ray;
  uint32_t index;  // index of the ray in the arrays of rays and hits
  uint32_t now;    // current node or block, or kNoChild at the end
  uint32_t top;    // number of elements in `waiting`
  float limit;
  uint32_t number;  // triangle number (kAny: block) of the best hit so far; kAll: number of rows stored
  uint32_t nodes, tests;
  bool found, undecided;
  alignas(64) uint32_t waiting[kTreeStack];
  float nears[kTreeStack];
};

// Kind of a ray's next step. kCandidates has all bits set, so that the bitwise or of kCandidates and any other step is
// kCandidates. kSteps is the number of kinds.
enum Step : uint32_t { kNode = 0, kBlock = 1, kEnd = 2, kCandidates = 3, kSteps = 4 };
// Returns the step that processes `reference`, the value of a child slot: kNode, kBlock, or kEnd for kNoChild.
static inline uint32_t step_at(uint32_t reference) { return (reference >> 31) + (reference == kNoChild ? 1u : 0u); }

// Lists of the rays being traced, one list for each kind of next step. A ray is identified by its index in RayStream's
// `flights`.
struct WorkList {
  uint8_t flights[kSteps][kMaxFlights];
  uint32_t counts[kSteps] = {};

  inline void add(uint32_t flight, uint32_t step) { flights[step][counts[step]++] = static_cast<uint8_t>(flight); }
  inline bool empty() const { return counts[kNode] + counts[kBlock] + counts[kEnd] == 0; }
};

// Kind of query: the nearest hit, any hit, or all hits.
enum class Wanted : uint8_t { kFirst, kAny, kAll };

// Tracer of up to kPreparedRays rays, selected by their indices, through one tree. In the member functions, `slot` is
// the index of a ray's element in `flights`.
template <Wanted kWanted>
class RayStream {
 public:
  inline RayStream(const TriangleTree& tree, const KernelRay* rays, const PreparedRays* prepared, KernelHit* hits,
                   KeptRows kept, const uint8_t* indices, uint32_t count, InFlightRay* flights)
      : tree_(tree),
        rays_(rays),
        prepared_(prepared),
        hits_(hits),
        kept_(kept),
        indices_(indices),
        count_(count),
        flights_(flights) {}

  // Traces all rays. Work that depends on the result of a step is done in a second loop over the same rays, so that the
  // processor's out-of-order window contains the independent steps of several rays.
  inline void run() {
    WorkList now;
    for (uint32_t flight = 0; flight < kMaxFlights && next_ != count_; ++flight) start(flight, now);
    while (!now.empty()) {
      WorkList next_steps;
      for (uint32_t i = 0; i < now.counts[kNode]; ++i) open_node(now.flights[kNode][i]);
      for (uint32_t i = 0; i < now.counts[kNode]; ++i) pop_next(now.flights[kNode][i], next_steps);
      for (uint32_t i = 0; i < now.counts[kBlock]; ++i) open_block(now.flights[kBlock][i]);
      for (uint32_t i = 0; i < now.counts[kBlock]; ++i) finish_block(now.flights[kBlock][i], next_steps);
      for (uint32_t i = 0; i < next_steps.counts[kCandidates]; ++i)
        resolve(next_steps.flights[kCandidates][i], next_steps);
      next_steps.counts[kCandidates] = 0;
      for (uint32_t i = 0; i < now.counts[kEnd]; ++i) end(now.flights[kEnd][i], next_steps);
      now = next_steps;
    }
  }

 private:
  static constexpr bool kAny = kWanted == Wanted::kAny, kAll = kWanted == Wanted::kAll;

  // Result of opening a block.
  struct OpenedBlock {
    BlockResults results;
    uint32_t index;  // index of the block
  };

  // Starts the next ray, at the root of the tree.
  inline void start(uint32_t slot, WorkList& next_steps) {
    InFlightRay& flight = flights_[slot];
    const uint32_t index = indices_[next_++];
    flight.ray = PreparedRay(prepared_[index / kTreeWidth], index % kTreeWidth);
    flight.index = index;
    flight.now = 0;
    flight.top = 1;
    flight.limit = flight.ray.value(kLimit);
    flight.number = kAll ? 0 : kNoNumber;
    flight.nodes = flight.tests = 0;
    flight.found = flight.undecided = false;
    flight.waiting[0] = kNoChild;
    if constexpr (kAny) {
      if (rays_[index].hint != kNoBlock) {
        flight.now = rays_[index].hint | kBlockBit;
        flight.waiting[flight.top++] = 0;  // the root: opened next if the ray hits no triangle of the block
        return next_steps.add(slot, kBlock);
      }
    }
    next_steps.add(slot, kNode);
  }

  // Opens the current node: pushes the children that the ray may hit, the nearest one last. If kAny, pushes them in the
  // order of their slots, because the query needs no particular hit.
  inline void open_node(uint32_t slot) {
    InFlightRay& flight = flights_[slot];
    const PreparedRay ray = flight.ray;
    const uint32_t octant = ray.integer(kOctant);
    const TriangleNode& node = tree_.nodes[flight.now];
    const float* const bounds = node.bounds[0];
    Floats8 near[3], far[3];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const Floats8 reciprocal = ray.splat(kReciprocal + axis);
      near[axis] = multiply_subtract(Floats8::load(bounds + kRows.entered[octant][axis]), reciprocal,
                                     ray.splat(kNearOffset + axis));
      far[axis] =
          multiply_subtract(Floats8::load(bounds + kRows.left[octant][axis]), reciprocal, ray.splat(kFarOffset + axis));
    }
    const Floats8 entered = maximum(maximum(near[0], near[1]), maximum(near[2], Floats8::splat(0)));
    const Floats8 left = minimum(minimum(far[0], far[1]), minimum(far[2], Floats8::splat(flight.limit)));
    uint32_t* const waiting = flight.waiting + flight.top;
    if constexpr (kAny)
      flight.top += pack_children(node, entered, left, waiting);
    else
      flight.top += pack_sorted(node, entered, left, octant, waiting, flight.nears + flight.top);
    ++flight.nodes;
  }

  // Pops the next node or block.
  inline void pop_next(uint32_t slot, WorkList& next_steps) {
    InFlightRay& flight = flights_[slot];
    const uint32_t reference = flight.waiting[--flight.top], step = step_at(reference);
    flight.now = reference;
    prefetch_next(reference, step);
    next_steps.add(slot, step);
  }

  // Tests the triangles of the current block in float.
  inline void open_block(uint32_t slot) {
    InFlightRay& flight = flights_[slot];
    const uint32_t block_index = flight.now & ~kBlockBit;
    const TriangleBlock& block = tree_.blocks[block_index];
    flight.tests += block.count;
    OpenedBlock& opened = opened_[slot];
    opened.results = test_block<kAny>(block, flight.ray, flight.limit, rays_[flight.index]);
    opened.index = block_index;
  }

  // Schedules resolve() if the opened block has candidates or the ray has exceeded kMaxKernelTests; resolve() then pops
  // the next node or block. In all other cases finish_block() pops the next node or block.
  inline void finish_block(uint32_t slot, WorkList& next_steps) {
    InFlightRay& flight = flights_[slot];
    // Computed without branches, because the processor would mispredict them too often.
    const uint32_t resolve_first = static_cast<uint32_t>(opened_[slot].results.candidates != 0) |
                                   static_cast<uint32_t>(flight.tests > kMaxKernelTests);
    const uint32_t next_reference = flight.waiting[flight.top - 1], step = step_at(next_reference);
    prefetch_next(next_reference, step);
    flight.top -= 1u - resolve_first;
    flight.now = next_reference;
    next_steps.add(slot, step | ((0u - resolve_first) & kCandidates));
  }

  // Tests the candidates of the opened block in double, then pops the next node or block, or ends the ray.
  inline void resolve(uint32_t slot, WorkList& next_steps) {
    const OpenedBlock& opened = opened_[slot];
    InFlightRay& flight = flights_[slot];
    if (kAny && opened.results.certain != 0) {
      flight.found = true;
      flight.number = opened.index;
    }
    const float limit = flight.limit;
    if (!kAny || !flight.found) decide_candidates(flight, opened);
    if (flight.tests > kMaxKernelTests) flight.undecided = true;
    if (flight.undecided || (kAny && flight.found)) return next_steps.add(slot, kEnd);
    if (flight.limit < limit) drop_beyond(flight);
    pop_next(slot, next_steps);
  }

  inline void decide_candidates(InFlightRay& flight, const OpenedBlock& opened) {
    const TriangleBlock& block = tree_.blocks[opened.index];
    for (uint32_t candidates = opened.results.candidates; candidates != 0; candidates &= candidates - 1u) {
      const int lane = __builtin_ctz(candidates);
      const Verdict verdict = decide(block, lane, rays_[flight.index], PreparedConstants{flight.ray});
      if (verdict.verdict == KernelVerdict::kUndecided) flight.undecided = true;
      if (verdict.verdict != KernelVerdict::kHit) continue;
      record_hit(flight, {verdict.t, kAny ? opened.index : number_of(tree_, block, lane)});
    }
  }

  inline void record_hit(InFlightRay& flight, KernelRow hit) const {
    if constexpr (kAll) {
      const KeptRows kept = {kept_.rows + uint64_t{flight.index} * kept_.max_rows, kept_.max_rows};
      kept.offer(hit, flight.number, flight.limit);
      flight.found = flight.number != 0;
    } else if (is_better(hit.t, hit.number, flight.limit, flight.found, flight.number)) {
      flight.limit = hit.t;
      flight.number = hit.number;
      flight.found = true;
    }
  }

  // Removes the elements of `waiting` that the ray enters beyond its limit. Elements entered exactly at the limit
  // remain: they may hold a hit at the same t with a lower triangle number.
  static inline void drop_beyond(InFlightRay& flight) {
    const Floats8 limit = Floats8::splat(flight.limit);
    uint32_t kept = 1;
    for (uint32_t from = 1; from < flight.top; from += kTreeWidth) {
      const uint32_t rest = flight.top - from;
      const uint32_t entries = rest >= kTreeWidth ? 255u : (1u << rest) - 1u;
      const Floats8 nears = Floats8::load_unaligned(flight.nears + from);
      const uint32_t keep =
          (planted(PlantedBug::kKernelPruneEqual) ? below(nears, limit) : at_most(nears, limit)) & entries;
      pack_entries(flight.waiting, flight.nears, from, keep, kept);
      kept += static_cast<uint32_t>(__builtin_popcount(keep));
    }
    flight.top = kept;
  }

  // Writes the answer of a ray, and starts the next ray if there is one.
  inline void end(uint32_t slot, WorkList& next_steps) {
    const InFlightRay& flight = flights_[slot];
    const KernelVerdict verdict = flight.undecided ? KernelVerdict::kUndecided
                                  : flight.found   ? KernelVerdict::kHit
                                                   : KernelVerdict::kMiss;
    hits_[flight.index] = {flight.limit, flight.number, verdict, flight.nodes, flight.tests};
    if (next_ != count_) start(slot, next_steps);
  }

  // Prefetches the next node or block. Its address is computed from tables indexed by the step, because a branch would
  // often be mispredicted.
  __attribute__((always_inline)) inline void prefetch_next(uint32_t reference, uint32_t step) const {
    const char* const at = bases_[step] + uint64_t{reference & ~kBlockBit} * sizes_[step];
    for (uint64_t line = 0; line < sizeof(TriangleBlock); line += 64) _mm_prefetch(at + line, _MM_HINT_T0);
  }

  const TriangleTree& tree_;
  const KernelRay* const rays_;
  const PreparedRays* const prepared_;
  KernelHit* const hits_;
  const KeptRows kept_;  // output rows of the first ray; used only if kAll
  const uint8_t* const indices_;
  const uint32_t count_;
  InFlightRay* const flights_;
  // Address and element size of the array that each step reads, used for prefetching. For kEnd the size is 0, so the
  // root is prefetched, which is harmless and needs no branch.
  const char* const bases_[3] = {reinterpret_cast<const char*>(tree_.nodes),
                                 reinterpret_cast<const char*>(tree_.blocks),
                                 reinterpret_cast<const char*>(tree_.nodes)};
  const uint64_t sizes_[3] = {sizeof(TriangleNode), sizeof(TriangleBlock), 0};
  uint32_t next_ = 0;
  OpenedBlock opened_[kMaxFlights];
};

// Rays of one trace() call that beams and packets have not answered.
struct Leftover {
  uint8_t groups[kPreparedRays / kTreeWidth];  // indices of groups of eight consecutive rays, which are prepared
  uint8_t rays[kPreparedRays];                 // indices of single rays
  uint32_t group_count = 0, ray_count = 0;
};

// Tracer of the beams among up to kPreparedRays rays.
template <bool kAny>
class BeamTracer {
 public:
  inline BeamTracer(const TriangleTree& tree, const KernelRay* rays, PreparedRays* prepared, KernelHit* hits,
                    uint32_t count, Leftover& left)
      : tree_(tree), rays_(rays), prepared_(prepared), hits_(hits), count_(count), left_(left) {}

  // Divides the rays into groups of kBeamRays consecutive rays, traces each group that forms a beam, and prepares the
  // rays of all other groups. Traces a few beams first: if most of these are not worth it, there are no other beams.
  inline void run() {
    constexpr uint32_t kFirstBeams = 8;
    while (first_ < count_ && beam_count_ < kFirstBeams) aim_next();
    const bool worth_it = trace();
    while (first_ < count_) {
      if (worth_it) {
        aim_next();
      } else {
        leave(first_);
        first_ += kBeamRays;
      }
    }
    trace();
  }

 private:
  inline void aim_next() {
    if (count_ - first_ >= kBeamRays && beams_[beam_count_].aim(tree_, rays_ + first_))
      firsts_[beam_count_++] = first_;
    else
      leave(first_);
    first_ += kBeamRays;
  }

  // Traces the beams aimed so far. Returns whether at least half of them were worth it.
  inline bool trace() {
    if (beam_count_ != 0) BeamStream<kAny>::run(beams_, beam_count_);
    uint32_t given_up = 0;
    for (uint32_t i = 0; i < beam_count_; ++i) {
      if (beams_[i].template finish<kAny>(hits_ + firsts_[i])) continue;
      leave(firsts_[i]);
      ++given_up;
    }
    const bool worth_it = 2 * given_up <= beam_count_;
    beam_count_ = 0;
    return worth_it;
  }

  inline void leave(uint32_t first) {
    for (uint32_t i = first; i < first + kBeamRays && i < count_; i += kTreeWidth) {
      prepare(rays_ + i, count_ - i, tree_.magnitude, prepared_[i / kTreeWidth]);
      left_.groups[left_.group_count++] = static_cast<uint8_t>(i / kTreeWidth);
    }
  }

  const TriangleTree& tree_;
  const KernelRay* const rays_;
  PreparedRays* const prepared_;
  KernelHit* const hits_;
  const uint32_t count_;
  Leftover& left_;
  uint32_t first_ = 0;  // index of the first ray of the next group
  Beam beams_[kMaxBeams];
  uint32_t firsts_[kMaxBeams], beam_count_ = 0;
};

// Traces each group of eight coherent rays of left.groups as one Packet, which writes the answers of these rays to
// `hits`. Appends the indices of all other rays to left.rays.
template <bool kAny>
static void trace_packets(const TriangleTree& tree, const KernelRay* rays, const PreparedRays* prepared,
                          KernelHit* hits, uint32_t count, Leftover& left) {
  uint32_t next_group = 0;
  // Starts `packet` with the next group of coherent rays. Returns false if no such group remains.
  const auto start_next = [&](Packet<kAny>& packet) {
    while (next_group < left.group_count) {
      const uint32_t group = left.groups[next_group++], now = group * kTreeWidth;
      const uint32_t size = count - now < kTreeWidth ? count - now : kTreeWidth;
      if (size == kTreeWidth && are_coherent(prepared[group], tree.magnitude)) {
        packet.start(tree, rays + now, prepared[group], hits + now);
        return true;
      }
      for (uint32_t i = now; i < now + size; ++i) left.rays[left.ray_count++] = static_cast<uint8_t>(i);
    }
    return false;
  };
  Packet<kAny> packets[kMaxPackets];
  Packet<kAny>* active[kMaxPackets];
  uint32_t packet_count = 0;
  while (packet_count < kMaxPackets && start_next(packets[packet_count])) {
    active[packet_count] = &packets[packet_count];
    ++packet_count;
  }
  while (packet_count != 0) {
    for (uint32_t i = 0; i < packet_count;) {
      if (active[i]->step() || start_next(*active[i]))
        ++i;
      else
        active[i] = active[--packet_count];
    }
  }
}

// Traces `count` rays, up to kPreparedRays at a time, and writes their answers to `hits` and, if kAll, to `kept`.
template <Wanted kWanted>
static inline void trace(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count,
                         KeptRows kept) {
  PreparedRays prepared[kPreparedRays / kTreeWidth];
  InFlightRay flights[kMaxFlights];
  while (count != 0) {
    const auto now = static_cast<uint32_t>(count < kPreparedRays ? count : kPreparedRays);
    Leftover left;
    if constexpr (kWanted == Wanted::kAll) {
      for (uint32_t i = 0; i < now; i += kTreeWidth)
        prepare(rays + i, now - i, tree.magnitude, prepared[i / kTreeWidth]);
      for (; left.ray_count < now; ++left.ray_count) left.rays[left.ray_count] = static_cast<uint8_t>(left.ray_count);
    } else {
      BeamTracer<kWanted == Wanted::kAny>(tree, rays, prepared, hits, now, left).run();
      trace_packets<kWanted == Wanted::kAny>(tree, rays, prepared, hits, now, left);
    }
    RayStream<kWanted>(tree, rays, prepared, hits, kept, left.rays, left.ray_count, flights).run();
    rays += now;
    hits += now;
    count -= now;
    if (kWanted == Wanted::kAll) kept.rows += uint64_t{now} * kept.max_rows;
  }
}

static void trace_first(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count) {
  trace<Wanted::kFirst>(tree, rays, hits, count, {});
}
static void trace_any(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count) {
  trace<Wanted::kAny>(tree, rays, hits, count, {});
}
static void trace_all(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count, KernelRow* rows,
                      uint32_t max_rows) {
  trace<Wanted::kAll>(tree, rays, hits, count, {rows, max_rows});
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
