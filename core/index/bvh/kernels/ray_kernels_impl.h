// The ray kernels themselves, compiled once for each instruction set by the file that includes this one. Many rays are
// on their way at once, each a step at a time: while one waits for memory, the others go on, and as each kind of step
// is done for all rays that need it, the processor seldom guesses a branch wrongly, which costs it more than a step.
//
// Sources: Wald, Benthin, Boulos, Getting Rid of Packets, 2008 (single rays in wide trees); Kocberber, Falsafi, Grot,
// Asynchronous Memory Access Chaining, 2015 (many searches in flight).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_answer_impl.h"
#include "core/index/bvh/kernels/ray_block_impl.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/ray_packet_impl.h"
#include "core/index/bvh/kernels/ray_setup_impl.h"

namespace locus {
namespace {

constexpr uint32_t kMaxFlights = 32;     // rays on their way at once
constexpr uint32_t kMaxPackets = 2;      // of rays that go together, likewise
constexpr uint32_t kPreparedRays = 256;  // rays prepared at once; their numbers fit a byte

// A ray on its way. Waiting nodes and blocks start no later than the limit; below them stands kNoChild.
struct alignas(64) InFlightRay {
  PreparedRay ray;
  uint32_t index;
  uint32_t now;  // where it is: a node, a block, or kNoChild at its end
  uint32_t top;
  float limit;
  uint32_t number;  // of the best hit so far; kAll: of hits kept
  uint32_t nodes, tests;
  bool found, undecided;
  alignas(64) uint32_t waiting[kTreeStack];
  float nears[kTreeStack];
};

// What comes next for a ray; kCandidates has all bits of the others.
enum Step : uint32_t { kNode = 0, kBlock = 1, kEnd = 2, kCandidates = 3, kSteps = 4 };
static inline uint32_t step_at(uint32_t reference) { return (reference >> 31) + (reference == kNoChild ? 1u : 0u); }

// Who is to take which step.
struct WorkList {
  uint8_t flights[kSteps][kMaxFlights];
  uint32_t counts[kSteps] = {};

  inline void add(uint32_t flight, uint32_t step) { flights[step][counts[step]++] = static_cast<uint8_t>(flight); }
  inline bool empty() const { return counts[kNode] + counts[kBlock] + counts[kEnd] == 0; }
};

enum class Wanted : uint8_t { kFirst, kAny, kAll };

// Up to kPreparedRays rays through one tree: those whose numbers are given.
template <Wanted kWanted>
class RayStream {
 public:
  inline RayStream(const TriangleTree& tree, const KernelRay* rays, const PreparedRays* prepared, KernelHit* hits,
                   KeptRows kept, const uint8_t* numbers, uint32_t count, InFlightRay* flights)
      : tree_(tree),
        rays_(rays),
        prepared_(prepared),
        hits_(hits),
        kept_(kept),
        numbers_(numbers),
        count_(count),
        flights_(flights) {}

  // What hangs on the outcome of a step comes in a second pass over its rays: the processor, which looks only so far
  // ahead, is to find the steps of several rays there instead, none of which waits for another.
  inline void run() {
    WorkList now;
    for (uint32_t flight = 0; flight < kMaxFlights && next_ != count_; ++flight) start(flight, now);
    while (!now.empty()) {
      WorkList then;
      for (uint32_t i = 0; i < now.counts[kNode]; ++i) open_node(now.flights[kNode][i]);
      for (uint32_t i = 0; i < now.counts[kNode]; ++i) go_on(now.flights[kNode][i], then);
      for (uint32_t i = 0; i < now.counts[kBlock]; ++i) open_block(now.flights[kBlock][i]);
      for (uint32_t i = 0; i < now.counts[kBlock]; ++i) leave_block(now.flights[kBlock][i], then);
      for (uint32_t i = 0; i < then.counts[kCandidates]; ++i) settle(then.flights[kCandidates][i], then);
      then.counts[kCandidates] = 0;
      for (uint32_t i = 0; i < now.counts[kEnd]; ++i) end(now.flights[kEnd][i], then);
      now = then;
    }
  }

 private:
  static constexpr bool kAny = kWanted == Wanted::kAny, kAll = kWanted == Wanted::kAll;

  struct Met {
    BlockMet block;
    uint32_t number;  // of the block
  };

  inline void start(uint32_t number, WorkList& then) {
    InFlightRay& flight = flights_[number];
    const uint32_t index = numbers_[next_++];
    flight.ray = PreparedRay(prepared_[index / kTreeWidth], index % kTreeWidth);
    flight.index = index;
    flight.now = 0;
    flight.top = 1;
    flight.limit = flight.ray.number(kLimit);
    flight.number = kAll ? 0 : kNoNumber;
    flight.nodes = flight.tests = 0;
    flight.found = flight.undecided = false;
    flight.waiting[0] = kNoChild;
    then.add(number, kNode);
  }

  // Puts the children that the ray may hit on the stack, the nearest last.
  inline void open_node(uint32_t number) {
    InFlightRay& flight = flights_[number];
    const PreparedRay ray = flight.ray;
    const uint32_t octant = ray.whole(kOctant);
    const TriangleNode& node = tree_.nodes[flight.now];
    const float* const bounds = node.bounds[0];
    Floats8 near[3], far[3];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const Floats8 reciprocal = ray.spread(kReciprocal + axis);
      near[axis] = multiply_subtract(Floats8::load(bounds + kRows.entered[octant][axis]), reciprocal,
                                     ray.spread(kNearOffset + axis));
      far[axis] = multiply_subtract(Floats8::load(bounds + kRows.left[octant][axis]), reciprocal,
                                    ray.spread(kFarOffset + axis));
    }
    const Floats8 entered = maximum(maximum(near[0], near[1]), maximum(near[2], Floats8::all(0)));
    const Floats8 left = minimum(minimum(far[0], far[1]), minimum(far[2], Floats8::all(flight.limit)));
    uint32_t* const waiting = flight.waiting + flight.top;
    if constexpr (kAny)
      flight.top += pack_children(node, entered, left, waiting);
    else
      flight.top += pack_sorted(node, entered, left, octant, waiting, flight.nears + flight.top);
    ++flight.nodes;
  }

  // Goes to the next of those that wait.
  inline void go_on(uint32_t number, WorkList& then) {
    InFlightRay& flight = flights_[number];
    const uint32_t reference = flight.waiting[--flight.top], step = step_at(reference);
    flight.now = reference;
    fetch(reference, step);
    then.add(number, step);
  }

  inline void open_block(uint32_t number) {
    InFlightRay& flight = flights_[number];
    const uint32_t block_number = flight.now & ~kBlockBit;
    const TriangleBlock& block = tree_.blocks[block_number];
    flight.tests += block.count;
    Met& met = met_[number];
    met.block = meet_block<kAny>(block, flight.ray, flight.limit, rays_[flight.index]);
    met.number = block_number;
  }

  // To what waits behind it, or to have decided first what it left open.
  inline void leave_block(uint32_t number, WorkList& then) {
    InFlightRay& flight = flights_[number];
    // Branches would be guessed wrongly too often here.
    const uint32_t settle_first =
        static_cast<uint32_t>(met_[number].block.open != 0) | static_cast<uint32_t>(flight.tests > kMaxKernelTests);
    const uint32_t behind = flight.waiting[flight.top - 1], step = step_at(behind);
    fetch(behind, step);
    flight.top -= 1u - settle_first;
    flight.now = behind;
    then.add(number, step | ((0u - settle_first) & kCandidates));
  }

  // Decides what float left open in a block, and goes on.
  inline void settle(uint32_t number, WorkList& then) {
    const Met& met = met_[number];
    InFlightRay& flight = flights_[number];
    if (kAny && met.block.sure != 0) flight.found = true;
    const float limit = flight.limit;
    if (!kAny || !flight.found) decide_open(flight, met);
    if (flight.tests > kMaxKernelTests) flight.undecided = true;
    if (flight.undecided || (kAny && flight.found)) return then.add(number, kEnd);
    if (flight.limit < limit) drop_beyond(flight);
    go_on(number, then);
  }

  inline void decide_open(InFlightRay& flight, const Met& met) {
    const TriangleBlock& block = tree_.blocks[met.number];
    for (uint32_t open = met.block.open; open != 0; open &= open - 1u) {
      const int place = __builtin_ctz(open);
      const Verdict verdict = decide(block, place, rays_[flight.index], flight.ray);
      if (verdict.what == KernelVerdict::kUndecided) flight.undecided = true;
      if (verdict.what != KernelVerdict::kHit) continue;
      take(flight, {verdict.t, number_of(tree_, block, place)});
    }
  }

  inline void take(InFlightRay& flight, KernelRow hit) const {
    if constexpr (kAll) {
      const KeptRows kept = {kept_.rows + uint64_t{flight.index} * kept_.most, kept_.most};
      kept.offer(hit, flight.number, flight.limit);
      flight.found = flight.number != 0;
    } else if (is_better(hit.t, hit.number, flight.limit, flight.found, flight.number)) {
      flight.limit = hit.t;
      flight.number = hit.number;
      flight.found = true;
    }
  }

  // Those that start exactly at the limit stay: a lower number may wait there.
  static inline void drop_beyond(InFlightRay& flight) {
    const Floats8 limit = Floats8::all(flight.limit);
    uint32_t kept = 1;
    for (uint32_t from = 1; from < flight.top; from += kTreeWidth) {
      const uint32_t rest = flight.top - from;
      const uint32_t entries = rest >= kTreeWidth ? 255u : (1u << rest) - 1u;
      const Floats8 nears = Floats8::load_any(flight.nears + from);
      const uint32_t keep =
          (planted(PlantedBug::kKernelPruneEqual) ? below(nears, limit) : at_most(nears, limit)) & entries;
      pack_entries(flight.waiting, flight.nears, from, keep, kept);
      kept += static_cast<uint32_t>(__builtin_popcount(keep));
    }
    flight.top = kept;
  }

  inline void end(uint32_t number, WorkList& then) {
    const InFlightRay& flight = flights_[number];
    const KernelVerdict verdict = flight.undecided ? KernelVerdict::kUndecided
                                  : flight.found   ? KernelVerdict::kHit
                                                   : KernelVerdict::kMiss;
    hits_[flight.index] = {flight.limit, flight.number, verdict, flight.nodes, flight.tests};
    if (next_ != count_) start(number, then);
  }

  // Asks for the memory of what comes next. By a table: a branch would be guessed wrongly as often as not.
  __attribute__((always_inline)) inline void fetch(uint32_t reference, uint32_t step) const {
    const char* const at = bases_[step] + uint64_t{reference & ~kBlockBit} * sizes_[step];
    for (uint64_t line = 0; line < sizeof(TriangleBlock); line += 64) _mm_prefetch(at + line, _MM_HINT_T0);
  }

  const TriangleTree& tree_;
  const KernelRay* const rays_;
  const PreparedRays* const prepared_;
  KernelHit* const hits_;
  const KeptRows kept_;  // kAll: of the first ray
  const uint8_t* const numbers_;
  const uint32_t count_;
  InFlightRay* const flights_;
  // Where the things of each step lie; what has come to its end asks for the root.
  const char* const bases_[3] = {reinterpret_cast<const char*>(tree_.nodes),
                                 reinterpret_cast<const char*>(tree_.blocks),
                                 reinterpret_cast<const char*>(tree_.nodes)};
  const uint64_t sizes_[3] = {sizeof(TriangleNode), sizeof(TriangleBlock), 0};
  uint32_t next_ = 0;
  Met met_[kMaxFlights];
};

// Answers the groups of eight that go together; lists the other rays in `rest` and returns how many they are.
template <bool kAny>
static uint32_t trace_packets(const TriangleTree& tree, const KernelRay* rays, const PreparedRays* prepared,
                              KernelHit* hits, uint32_t count, uint8_t* rest) {
  uint32_t left = 0, first = 0;
  // False where none is left.
  const auto start_next = [&](Packet<kAny>& packet) {
    while (first < count) {
      const uint32_t now = first, size = count - now < kTreeWidth ? count - now : kTreeWidth;
      first += size;
      if (size == kTreeWidth && go_together(prepared[now / kTreeWidth], tree.magnitude)) {
        packet.start(tree, rays + now, prepared[now / kTreeWidth], hits + now);
        return true;
      }
      for (uint32_t i = now; i < first; ++i) rest[left++] = static_cast<uint8_t>(i);
    }
    return false;
  };
  Packet<kAny> packets[kMaxPackets];
  Packet<kAny>* under_way[kMaxPackets];
  uint32_t packet_count = 0;
  while (packet_count < kMaxPackets && start_next(packets[packet_count])) {
    under_way[packet_count] = &packets[packet_count];
    ++packet_count;
  }
  while (packet_count != 0) {
    for (uint32_t i = 0; i < packet_count;) {
      if (under_way[i]->step() || start_next(*under_way[i]))
        ++i;
      else
        under_way[i] = under_way[--packet_count];
    }
  }
  return left;
}

template <Wanted kWanted>
static inline void trace(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count,
                         KeptRows kept) {
  PreparedRays prepared[kPreparedRays / kTreeWidth];
  uint8_t rest[kPreparedRays];
  InFlightRay flights[kMaxFlights];
  while (count != 0) {
    const auto now = static_cast<uint32_t>(count < kPreparedRays ? count : kPreparedRays);
    for (uint32_t i = 0; i < now; i += kTreeWidth) prepare(rays + i, now - i, tree.magnitude, prepared[i / kTreeWidth]);
    uint32_t left = 0;
    if constexpr (kWanted == Wanted::kAll) {
      for (; left < now; ++left) rest[left] = static_cast<uint8_t>(left);
    } else {
      left = trace_packets<kWanted == Wanted::kAny>(tree, rays, prepared, hits, now, rest);
    }
    RayStream<kWanted>(tree, rays, prepared, hits, kept, rest, left, flights).run();
    rays += now;
    hits += now;
    count -= now;
    if (kWanted == Wanted::kAll) kept.rows += uint64_t{now} * kept.most;
  }
}

static void trace_first(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count) {
  trace<Wanted::kFirst>(tree, rays, hits, count, {});
}
static void trace_any(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count) {
  trace<Wanted::kAny>(tree, rays, hits, count, {});
}
static void trace_all(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count, KernelRow* rows,
                      uint32_t most) {
  trace<Wanted::kAll>(tree, rays, hits, count, {rows, most});
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
