// Writes hits into the columns of an answer: one row a hit, and a row of a miss where rows are dense.
#ifndef LOCUS_CORE_QUERY_RUN_ROWS_H_
#define LOCUS_CORE_QUERY_RUN_ROWS_H_

#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/nearest_query.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/query_batch.h"
#include "core/query/run/answer_sink.h"

namespace locus {

// Writes the columns of row `row` that every kind has; a miss where `hit` names nothing.
void write_row(const Hit& hit, const RowSpans& to, size_t row);
// Writes a row like `hit` for each of some triangles, from row `row` on.
void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row);
// Writes a row for each of some objects, as they were at `moment`, from the first row on.
void write_object_rows(absl::Span<const FoundObject> objects, const SceneAtTime& moment, const RowSpans& to);
// Writes what only hits of rays have: uv, normal and point, the latter relative to the frame.
void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row);

// Writes the point of a row of what is nearest, relative to the frame, where it is wanted.
void write_nearest_point(const NearestRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ROWS_H_
