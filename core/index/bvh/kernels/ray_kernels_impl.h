// The ray kernels themselves, compiled once for each instruction set by the file that includes this one. The error
// bounds, with R = max |origin| + max |vertex|, E = the block's extent, and lengths along the shear divided by the
// direction's largest component d:
//
// - A sheared coordinate is off by at most 9 * 2^-24 R: rounding the origin, the differences, the shear, the product.
//   A ray that meets the block's box passes within 2^-20 R of it, so sheared coordinates are at most 2 E + 2^-18 R, and
//   an edge function, two products and a difference, is off by less than edge = 2^-17 R E + 2^-36 R^2.
// - t is an average of vertex depths with the edge functions as weights. It is off by at most
//   (6 edge E / |determinant| + 2^-20 R) / |d| where |determinant| > 8 edge. A ray that starts on a triangle hits it
//   although rounding puts it behind by up to 2^-42 R^3 / |determinant / d|, which the interval of t includes.
//   Products that underflow add at most 2^-150 / |determinant|, within the 2^-20 R / |d| for R from 2^-25 and |d| to
//   2^20.
// - The same in double is smaller by 2^-29. Where it moves a hit by less than 2^-24 of its own coordinates, the hit
//   lies in the padded slabs of its own box, so that TriangleRay's and the placed bounds' clamps leave t as it is.
//
// Source: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, 2013 (the test); Wald, Benthin, Boulos, Getting
// Rid of Packets, 2008 (single rays in wide trees).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_

#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"

namespace locus {
namespace {

constexpr uint32_t kNoNumber = 0xFFFFFFFFu;
constexpr float kTreePad = 0x1p-20f;  // twice the triangle's own, so that no rounding here culls what that would keep

static inline double size_of(double value) { return value < 0 ? -value : value; }
static inline double larger(double a, double b) { return a < b ? b : a; }
static inline double smaller(double a, double b) { return b < a ? b : a; }

// One ray on its way through one tree.
struct Traveller {
  Floats8 reciprocal[3], near_offset[3], far_offset[3], limit8;
  int near_row[3], far_row[3];  // rows of TriangleNode::bounds
  uint32_t octant;
  float origin[4];
  int x, y, z;  // axes of the shear; z is the direction's largest component
  float shear_x, shear_y, reciprocal_z, size_of_reciprocal_z;
  float edge_scale, edge_floor, start_noise, t_floor;
  float limit;
  uint32_t number = kNoNumber;  // of the best hit so far
  bool found = false, undecided = false;
  bool promised = false;  // float is certain of a hit at or before `limit`, which double has yet to confirm
  uint32_t nodes = 0, tests = 0;
  const KernelRay* ray;

  inline Traveller(const KernelRay& given, float magnitude);
};

static inline __m128 largest_of(__m128 v) {
  v = _mm_max_ps(v, _mm_shuffle_ps(v, v, _MM_SHUFFLE(1, 0, 3, 2)));
  return _mm_max_ps(v, _mm_shuffle_ps(v, v, _MM_SHUFFLE(2, 3, 0, 1)));
}

static inline __m128 to_floats(const double* three) {
  return _mm_movelh_ps(_mm_cvtpd_ps(_mm_loadu_pd(three)), _mm_cvtpd_ps(_mm_load_sd(three + 2)));
}

static inline void spread(__m128 three, Floats8* to) {
  to[0].v = _mm256_broadcastss_ps(three);
  to[1].v = _mm256_broadcastss_ps(_mm_shuffle_ps(three, three, _MM_SHUFFLE(1, 1, 1, 1)));
  to[2].v = _mm256_broadcastss_ps(_mm_shuffle_ps(three, three, _MM_SHUFFLE(2, 2, 2, 2)));
}

// The axis of the largest component, the first of equals, as TriangleRay chooses. `candidates`: those that float cannot
// tell apart.
static inline int largest_axis(const double* direction, uint32_t candidates) {
  int axis = __builtin_ctz(candidates);
  for (uint32_t rest = candidates & (candidates - 1u); rest != 0; rest &= rest - 1u) {
    const int other = __builtin_ctz(rest);
    if (size_of(direction[other]) > size_of(direction[axis])) axis = other;
  }
  return axis;
}

inline Traveller::Traveller(const KernelRay& given, float magnitude) : limit(given.limit), ray(&given) {
  const __m128 sign = _mm_set1_ps(-0.0f);
  const __m128 from = to_floats(given.origin), along = to_floats(given.direction);
  const __m128 reach = _mm_add_ps(largest_of(_mm_andnot_ps(sign, from)), _mm_set1_ps(magnitude));
  const __m128 sizes = _mm_andnot_ps(sign, along);
  const __m128 longest = largest_of(sizes);
  // As SlabRay does: a component of zero becomes 1e-18 of the largest.
  const __m128 kept = _mm_max_ps(sizes, _mm_mul_ps(longest, _mm_set1_ps(1e-18f)));
  const __m128 inverse = _mm_div_ps(_mm_set1_ps(1.0f), _mm_or_ps(kept, _mm_and_ps(sign, along)));
  const __m128 center = _mm_mul_ps(from, inverse);
  const __m128 pad = _mm_mul_ps(_mm_mul_ps(reach, _mm_set1_ps(kTreePad)), _mm_andnot_ps(sign, inverse));
  spread(inverse, reciprocal);
  spread(_mm_add_ps(center, pad), near_offset);
  spread(_mm_sub_ps(center, pad), far_offset);
  limit8 = Floats8::all(limit);
  octant = static_cast<uint32_t>(_mm_movemask_ps(along)) & 7u;
  for (int axis = 0; axis < 3; ++axis) {
    const int negative = static_cast<int>(octant >> axis & 1u) * 3;
    near_row[axis] = axis + negative;
    far_row[axis] = axis + 3 - negative;
  }
  _mm_storeu_ps(origin, from);
  z = largest_axis(given.direction, static_cast<uint32_t>(_mm_movemask_ps(_mm_cmpge_ps(sizes, longest))) & 7u);
  x = z == 2 ? 0 : z + 1;
  y = x == 2 ? 0 : x + 1;
  if ((octant >> z & 1u) != 0) {  // keeps the winding: seen along the ray, x to y always turns the same way
    const int other = x;
    x = y;
    y = other;
  }
  alignas(16) float component[4], turned[4];
  _mm_store_ps(component, along);
  _mm_store_ps(turned, inverse);
  reciprocal_z = turned[z];
  size_of_reciprocal_z = reciprocal_z < 0 ? -reciprocal_z : reciprocal_z;
  shear_x = component[x] * reciprocal_z;
  shear_y = component[y] * reciprocal_z;
  const float r = _mm_cvtss_f32(reach);
  edge_scale = r * 0x1p-17f;
  edge_floor = r * r * 0x1p-36f;
  start_noise = r * r * r * 0x1p-42f;
  t_floor = r * 0x1p-20f * size_of_reciprocal_z;
}

// Bits of the children that the ray may hit within its limit, and where it enters them.
static inline uint32_t meet_node(const TriangleNode& node, const Traveller& ray, Floats8& near) {
  const Floats8 near_x =
      multiply_subtract(Floats8::load(node.bounds[ray.near_row[0]]), ray.reciprocal[0], ray.near_offset[0]);
  const Floats8 near_y =
      multiply_subtract(Floats8::load(node.bounds[ray.near_row[1]]), ray.reciprocal[1], ray.near_offset[1]);
  const Floats8 near_z =
      multiply_subtract(Floats8::load(node.bounds[ray.near_row[2]]), ray.reciprocal[2], ray.near_offset[2]);
  const Floats8 far_x =
      multiply_subtract(Floats8::load(node.bounds[ray.far_row[0]]), ray.reciprocal[0], ray.far_offset[0]);
  const Floats8 far_y =
      multiply_subtract(Floats8::load(node.bounds[ray.far_row[1]]), ray.reciprocal[1], ray.far_offset[1]);
  const Floats8 far_z =
      multiply_subtract(Floats8::load(node.bounds[ray.far_row[2]]), ray.reciprocal[2], ray.far_offset[2]);
  near = larger(larger(near_x, near_y), larger(near_z, Floats8::all(0)));
  const Floats8 far = smaller(smaller(far_x, far_y), smaller(far_z, ray.limit8));
  return at_most(near, far);
}

// The eight triangles of a block in the projection along the ray.
struct Projected {
  Floats8 weight_a, weight_b, weight_c;  // edge functions
  Floats8 a_z, b_z, c_z;                 // depths
};

static inline Projected project(const TriangleBlock& block, const Traveller& ray) {
  const Floats8 from_x = Floats8::all(ray.origin[ray.x]), from_y = Floats8::all(ray.origin[ray.y]),
                from_z = Floats8::all(ray.origin[ray.z]);
  const Floats8 shear_x = Floats8::all(ray.shear_x), shear_y = Floats8::all(ray.shear_y);
  Projected p;
  p.a_z = Floats8::load(block.vertices[ray.z]) - from_z;
  p.b_z = Floats8::load(block.vertices[3 + ray.z]) - from_z;
  p.c_z = Floats8::load(block.vertices[6 + ray.z]) - from_z;
  const Floats8 a_x = subtract_product(Floats8::load(block.vertices[ray.x]) - from_x, shear_x, p.a_z);
  const Floats8 a_y = subtract_product(Floats8::load(block.vertices[ray.y]) - from_y, shear_y, p.a_z);
  const Floats8 b_x = subtract_product(Floats8::load(block.vertices[3 + ray.x]) - from_x, shear_x, p.b_z);
  const Floats8 b_y = subtract_product(Floats8::load(block.vertices[3 + ray.y]) - from_y, shear_y, p.b_z);
  const Floats8 c_x = subtract_product(Floats8::load(block.vertices[6 + ray.x]) - from_x, shear_x, p.c_z);
  const Floats8 c_y = subtract_product(Floats8::load(block.vertices[6 + ray.y]) - from_y, shear_y, p.c_z);
  p.weight_a = multiply_subtract(c_x, b_y, c_y * b_x);
  p.weight_b = multiply_subtract(a_x, c_y, a_y * c_x);
  p.weight_c = multiply_subtract(b_x, a_y, b_y * a_x);
  return p;
}

struct Verdict {
  KernelVerdict what;
  float t;
};

// One triangle in double: TriangleRay::edge_test() without its scaling, which changes no bit within the directions and
// distances accepted here. `edge`: the bound of the float edge functions.
static Verdict decide(const TriangleBlock& block, int lane, const Traveller& ray, double edge) {
  const KernelRay& given = *ray.ray;
  const double from_x = given.origin[ray.x], from_y = given.origin[ray.y], from_z = given.origin[ray.z];
  const double dx = given.direction[ray.x], dy = given.direction[ray.y], dz = given.direction[ray.z];
  const double az = double{block.vertices[ray.z][lane]} - from_z;
  const double bz = double{block.vertices[3 + ray.z][lane]} - from_z;
  const double cz = double{block.vertices[6 + ray.z][lane]} - from_z;
  const double ax = (double{block.vertices[ray.x][lane]} - from_x) * dz - az * dx;
  const double ay = (double{block.vertices[ray.y][lane]} - from_y) * dz - az * dy;
  const double bx = (double{block.vertices[3 + ray.x][lane]} - from_x) * dz - bz * dx;
  const double by = (double{block.vertices[3 + ray.y][lane]} - from_y) * dz - bz * dy;
  const double cx = (double{block.vertices[6 + ray.x][lane]} - from_x) * dz - cz * dx;
  const double cy = (double{block.vertices[6 + ray.y][lane]} - from_y) * dz - cz * dy;
  const double weight_a = cx * by - cy * bx;
  const double weight_b = ax * cy - ay * cx;
  const double weight_c = bx * ay - by * ax;
  const double least = smaller(weight_a, smaller(weight_b, weight_c));
  const double most = larger(weight_a, larger(weight_b, weight_c));
  if (least < 0 && most > 0) return {KernelVerdict::kMiss, 0};
  const double determinant = weight_a + weight_b + weight_c;
  if (determinant == 0 || !(determinant > 0 ? given.accept_front : given.accept_back)) return {KernelVerdict::kMiss, 0};
  const double unit = dz * dz;
  const double noise = edge * 0x1p-29 * unit;
  if (size_of(determinant) < 0.5 * edge * unit) {
    double reach = 0, largest_origin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      largest_origin = larger(largest_origin, size_of(given.origin[axis]));
      for (int vertex = 0; vertex < 3; ++vertex)
        reach = larger(reach, size_of(double{block.vertices[3 * vertex + axis][lane]}));
    }
    const double depth_span = larger(az, larger(bz, cz)) - smaller(az, smaller(bz, cz));
    const bool clear = size_of(determinant) > 16 * noise &&
                       6 * noise * depth_span < size_of(determinant) * 0x1p-24 * (reach + largest_origin);
    if (!clear) return {KernelVerdict::kUndecided, 0};
  }
  const double t = (weight_a * az + weight_b * bz + weight_c * cz) / (determinant * dz);
  // Just behind the start is for the bound of TriangleRay::depth_noise() to judge; what is far behind, is not hit.
  const double start_noise = double{ray.start_noise} * double{ray.size_of_reciprocal_z} * unit;
  if (t < -start_noise / size_of(determinant) - double{ray.t_floor}) return {KernelVerdict::kMiss, 0};
  if (t < 0 || (t > 0 && t < 1e-30) || !(t < 1e30)) return {KernelVerdict::kUndecided, 0};
  return {KernelVerdict::kHit, static_cast<float>(t) + 0.0f};
}

// A triangle that float could not rule out, to be decided in double once the visit is over: by then a nearer one has
// mostly ruled it out.
struct Candidate {
  const TriangleBlock* block;
  int lane;
  float earliest;  // it is hit here or later
  float edge;
};

class Candidates {
 public:
  // False when there is no room left.
  inline bool add(const Candidate& candidate, float limit) {
    if (count_ == kMost) drop_beyond(limit);
    if (count_ == kMost) return false;
    all_[count_++] = candidate;
    return true;
  }
  inline int count() const { return count_; }
  inline const Candidate& operator[](int i) const { return all_[i]; }

 private:
  static constexpr int kMost = 64;

  void drop_beyond(float limit) {
    int kept = 0;
    for (int i = 0; i < count_; ++i)
      if (all_[i].earliest <= limit) all_[kept++] = all_[i];
    count_ = kept;
  }

  Candidate all_[kMost];
  int count_ = 0;
};

static inline float least_of(Floats8 values, uint32_t lanes) {
  alignas(32) float stored[kTreeWidth];
  values.store(stored);
  float least = stored[__builtin_ctz(lanes)];
  for (uint32_t rest = lanes & (lanes - 1u); rest != 0; rest &= rest - 1u) {
    const float other = stored[__builtin_ctz(rest)];
    if (other < least) least = other;
  }
  return least;
}

// Meets a block's triangles. True when the visit is over.
template <bool kAny>
static inline bool meet_block(const TriangleBlock& block, Traveller& ray, Candidates& candidates) {
  ray.tests += block.count;
  const Projected p = project(block, ray);
  const float edge = ray.edge_scale * block.extent + ray.edge_floor;
  const Floats8 bound = Floats8::all(edge), minus_bound = Floats8::all(-edge), zero = Floats8::all(0);
  const Floats8 least = smaller(p.weight_a, smaller(p.weight_b, p.weight_c));
  const Floats8 most = larger(p.weight_a, larger(p.weight_b, p.weight_c));
  uint32_t open = at_most(minus_bound, least) | at_most(most, bound);
  if (open == 0) return false;
  const Floats8 determinant = p.weight_a + p.weight_b + p.weight_c;
  const Floats8 size = size_of(determinant), inverse = Floats8::all(1) / determinant;
  const Floats8 depth = multiply_add(p.weight_a, p.a_z, multiply_add(p.weight_b, p.b_z, p.weight_c * p.c_z)) *
                        Floats8::all(ray.reciprocal_z);
  const Floats8 t = depth * inverse;
  const float spread = (6 * edge * block.extent + ray.start_noise) * ray.size_of_reciprocal_z;
  const Floats8 off = multiply_add(Floats8::all(spread), size_of(inverse), Floats8::all(ray.t_floor));
  const Floats8 earliest = t - off, latest = t + off;
  open &= (1u << block.count) - 1u;
  const uint32_t unsure = at_most(size, Floats8::all(8 * edge)) & open;
  open = (open & ~unsure & at_most(earliest, ray.limit8) & at_most(zero, latest)) | unsure;
  if (open == 0) return false;
  uint32_t sure = open & ~unsure & below(zero, earliest) & at_most(latest, ray.limit8);
  sure &= (ray.ray->accept_front ? below(bound, least) : 0u) | (ray.ray->accept_back ? below(most, minus_bound) : 0u);
  if (sure != 0) {
    if constexpr (kAny) {
      ray.found = true;
      return true;
    }
    ray.promised = true;
    ray.limit = least_of(latest, sure);
    ray.limit8 = Floats8::all(ray.limit);
    open &= at_most(earliest, ray.limit8) | unsure;
  }
  alignas(32) float starts[kTreeWidth];
  earliest.store(starts);
  for (; open != 0; open &= open - 1u) {
    const int lane = __builtin_ctz(open);
    const float start = (unsure >> lane & 1u) != 0 ? -1 : starts[lane];
    if (!candidates.add({&block, lane, start, edge}, ray.limit)) {
      ray.undecided = true;
      return true;
    }
  }
  return false;
}

// The nearest of the candidates in double.
template <bool kAny>
static inline void settle(const TriangleTree& tree, const Candidates& candidates, Traveller& ray) {
  float best = ray.ray->limit;
  for (int i = 0; i < candidates.count(); ++i) {
    const Candidate& candidate = candidates[i];
    if (candidate.earliest > ray.limit || candidate.earliest > best) continue;
    const Verdict verdict = decide(*candidate.block, candidate.lane, ray, candidate.edge);
    if (verdict.what == KernelVerdict::kUndecided) ray.undecided = true;
    if (verdict.what != KernelVerdict::kHit || verdict.t > best) continue;
    const uint32_t number = tree.numbers[candidate.block->first + static_cast<uint32_t>(candidate.lane)];
    if (verdict.t == best && number >= ray.number) continue;
    best = verdict.t;
    ray.number = number;
    ray.found = true;
  }
  // Never, by the bounds above. Were one of them wrong, the triangles would be asked one by one.
  if (ray.promised && !(ray.found && best <= ray.limit)) ray.undecided = true;
  ray.limit = best;
}

template <bool kAny>
static inline void travel(const TriangleTree& tree, Traveller& ray, Candidates& candidates) {
  alignas(64) uint32_t waiting[kTreeStack];
  alignas(64) float nears[kTreeStack];
  int top = 0;
  uint32_t now = 0;
  for (;;) {
    if ((now & kBlockBit) != 0) {
      if (meet_block<kAny>(tree.blocks[now & ~kBlockBit], ray, candidates)) return;
      if (ray.tests > kMaxKernelTests) {
        ray.undecided = true;
        return;
      }
    } else {
      const TriangleNode& node = tree.nodes[now];
      ++ray.nodes;
      Floats8 near;
      const uint32_t met = meet_node(node, ray, near);
      if (met != 0) {
        if ((met & (met - 1u)) == 0) {
          now = node.child[__builtin_ctz(met)];
          continue;
        }
        if constexpr (kAny) {
          pack_children(node, met, waiting + top);
        } else {
          pack_sorted(node, met, near, ray.octant, waiting + top, nears + top);
        }
        top += __builtin_popcount(met) - 1;
        now = waiting[top];
        continue;
      }
    }
    do {
      if (top == 0) return;
      --top;
      // A box that starts exactly at the limit is opened: a lower number may wait there.
    } while (!kAny && nears[top] > ray.limit);
    now = waiting[top];
  }
}

template <bool kAny>
static void trace(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    Traveller ray(rays[i], tree.magnitude);
    Candidates candidates;
    travel<kAny>(tree, ray, candidates);
    if (!kAny || !ray.found) settle<kAny>(tree, candidates, ray);
    const KernelVerdict verdict = ray.undecided ? KernelVerdict::kUndecided
                                  : ray.found   ? KernelVerdict::kHit
                                                : KernelVerdict::kMiss;
    hits[i] = {ray.limit, ray.number, verdict, ray.nodes, ray.tests};
  }
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_IMPL_H_
