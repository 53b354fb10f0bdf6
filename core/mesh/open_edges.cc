#include "core/mesh/open_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "core/base/check.h"

namespace locus {
namespace {

// Directed edge between two corners.
struct Edge {
  uint32_t from, to;
};

// Edges of a mesh, grouped by their lower corner: ends_[start_[i]] to ends_[start_[i + 1] - 1] are the edges whose
// lower corner is i. Each element of ends_ has the higher corner of its edge in the upper bits. Its lowest bit is set
// if the edge goes from the higher to the lower corner.
class EdgesByCorner {
 public:
  // `for_each` calls its argument with each edge, in the same order each time.
  template <class ForEach>
  EdgesByCorner(size_t corners, const ForEach& for_each) : start_(corners + 1) {
    for_each([this](Edge edge) { ++start_[std::min(edge.from, edge.to) + size_t{1}]; });
    for (size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
    ends_.resize(start_.back());
    std::vector<uint32_t> next(start_.begin(), start_.end() - 1);
    for_each([&](Edge edge) {
      const bool falls = edge.from > edge.to;
      ends_[next[std::min(edge.from, edge.to)]++] = uint64_t{std::max(edge.from, edge.to)} << 1 | uint64_t{falls};
    });
  }

  // Calls visit(edge, excess) for each edge that is used `excess` times more in the direction of `edge` than in the
  // opposite direction.
  template <class Visit>
  void for_each_open(const Visit& visit) {
    for (size_t corner = 0; corner + 1 < start_.size(); ++corner) {
      const auto begin = ends_.begin() + start_[corner], end = ends_.begin() + start_[corner + 1];
      std::sort(begin, end);
      for (auto at = begin; at != end;) {
        const uint64_t other = *at >> 1;
        int64_t excess = 0;
        for (; at != end && *at >> 1 == other; ++at) excess += (*at & 1) == 0 ? 1 : -1;
        const auto low = static_cast<uint32_t>(corner), high = static_cast<uint32_t>(other);
        if (excess > 0) visit(Edge{low, high}, static_cast<uint64_t>(excess));
        if (excess < 0) visit(Edge{high, low}, static_cast<uint64_t>(-excess));
      }
    }
  }

 private:
  std::vector<uint32_t> start_;
  std::vector<uint64_t> ends_;
};

// Replaces the corners of `edges` by numbers that are equal for corners with equal coordinates. Returns the number of
// different corners.
size_t join_equal_corners(absl::Span<const float> vertices, std::vector<Edge>& edges) {
  const auto position = [vertices](uint32_t corner) {
    const float* const at = &vertices[size_t{3} * corner];
    return std::tuple(at[0] + 0.0f, at[1] + 0.0f, at[2] + 0.0f);
  };
  std::vector<uint32_t*> ends;
  ends.reserve(2 * edges.size());
  for (Edge& edge : edges) {
    ends.push_back(&edge.from);
    ends.push_back(&edge.to);
  }
  std::sort(ends.begin(), ends.end(),
            [&](const uint32_t* a, const uint32_t* b) { return position(*a) < position(*b); });
  size_t count = 0;
  for (size_t i = 0; i < ends.size();) {
    const auto first = position(*ends[i]);
    for (; i < ends.size() && position(*ends[i]) == first; ++i) *ends[i] = static_cast<uint32_t>(count);
    ++count;
  }
  return count;
}

}  // namespace

uint64_t count_open_edges(absl::Span<const float> vertices, absl::Span<const uint32_t> indices) {
  LOCUS_DCHECK_EQ(indices.size() % 3, size_t{0});
  // First cancels opposite edges by vertex index; in most meshes, no or few edges remain. Then cancels the remaining
  // edges by coordinates. Edges that cancel by index would also cancel by coordinates.
  EdgesByCorner by_index(vertices.size() / 3, [indices](const auto& visit) {
    for (size_t i = 0; i < indices.size(); i += 3)
      for (const Edge edge :
           {Edge{indices[i], indices[i + 1]}, Edge{indices[i + 1], indices[i + 2]}, Edge{indices[i + 2], indices[i]}})
        if (edge.from != edge.to) visit(edge);
  });
  std::vector<Edge> open;
  by_index.for_each_open([&open](Edge edge, uint64_t excess) { open.insert(open.end(), excess, edge); });
  if (open.empty()) return 0;
  const size_t corners = join_equal_corners(vertices, open);
  EdgesByCorner by_position(corners, [&open](const auto& visit) {
    for (const Edge edge : open)
      if (edge.from != edge.to) visit(edge);
  });
  uint64_t count = 0;
  by_position.for_each_open([&count](Edge, uint64_t excess) { count += excess; });
  return count;
}

}  // namespace locus
