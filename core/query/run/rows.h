// Writes hits into result columns: one row per hit, and one row per miss in dense results. Free functions; several
// threads may write different rows at once.
#ifndef LOCUS_CORE_QUERY_RUN_ROWS_H_
#define LOCUS_CORE_QUERY_RUN_ROWS_H_

#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/nearest_query.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/query_batch.h"
#include "core/query/run/answer_sink.h"

namespace locus {

// Writes the columns of row `row` that are common to all kinds of queries. A default-constructed hit is a miss.
void write_row(const Hit& hit, const RowSpans& to, size_t row);
// Writes one row per triangle, otherwise equal to the row of `hit`, starting at row `row`.
void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row);
// Writes one row per object, with its pose at `moment`, starting at row 0.
void write_object_rows(absl::Span<const FoundObject> objects, const SceneAtTime& moment, const RowSpans& to);
// Writes the columns that only ray hits have: uv, normal, and the point relative to the frame.
void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row);

// Writes the nearest point of a row of a nearest query, relative to the frame, if that column is returned.
void write_nearest_point(const NearestRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ROWS_H_
