// Functions that write hits into result columns: one row per hit, and in dense results also one row per miss. Several
// threads may write different rows at the same time.
#ifndef LOCUS_CORE_QUERY_RUN_ROWS_H_
#define LOCUS_CORE_QUERY_RUN_ROWS_H_

#include "core/geometry/mover.h"
#include "core/query/kinds/cell_query.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/nearest_query.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/kinds/sweep_query.h"
#include "core/query/query_batch.h"
#include "core/query/run/answer_sink.h"

namespace locus {

// Writes the columns of row `row` that are common to all kinds of queries. A default-constructed hit is a miss.
void write_row(const Hit& hit, const RowSpans& to, size_t row);
// Writes all columns of a row without a hit.
void write_miss(const RowSpans& to, size_t row);
// Writes zeros to the columns uv, normal and point of a row.
void write_no_surface(const RowSpans& to, size_t row);
// Writes one row of an overlap query for each of `triangles`, starting at row `row`. The columns id, group, tag, layers
// and pose have the values of `hit`. The columns t, normal and point are not written.
void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row);
// Writes one row per object, starting at row 0. The pose of an object is its pose at `moment`.
void write_object_rows(absl::Span<const FoundObject> objects, const SceneAtTime& moment, const RowSpans& to);
// Writes the columns uv, normal and point for a hit of a ray, except columns that the block does not return. The point
// is relative to `frame`.
void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row);

// Writes the columns t, normal and point for a row of a ball, capsule or box query, except columns that the block does
// not return. `solid` is the query's ball, capsule or box in world axes, represented by a mover that rests. `triangle`
// is the triangle whose contact is computed, or kNoTriangle for an object. `triangle` is also kNoTriangle for a
// CONSERVATIVE row of a whole instance: then the contact is with the bounds of the instance. The point is relative to
// `frame`.
void write_overlap_contact(const Mover& solid, Precision precision, Vec3d frame, const Hit& hit, uint32_t triangle,
                           const RowSpans& to, size_t row);

// Writes the columns normal and point for a hit of a sweep, except columns that the block does not return. The point is
// relative to `frame`.
void write_contact(const SweepRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row);
// Writes the columns uv, normal and point for a row of a nearest query, except columns that the block does not return.
// The point is relative to `frame`.
void write_nearest_surface(const NearestRequest& request, Vec3d frame, const Hit& hit, Winding winding,
                           const RowSpans& to, size_t row);

// Writes the first `rows` rows of a cell, beginning at row 0: a row with the radius, then one row for each plane.
// `point` is the query's point, relative to the block's frame.
void write_cell(const CellAnswer& cell, Vec3d point, const RowSpans& to, size_t rows);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ROWS_H_
