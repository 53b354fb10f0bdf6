// Placement of a camera that frames a box: the nearest position from which all of the box is in the picture. For
// `locus render` without --eye. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_

#include "client/cli/extras/render/camera.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// Projection of a camera, without its position.
struct Lens {
  Projection projection = Projection::kPerspective;
  double half_height = 1;  // as Camera::half_height; orthographic: 0 = as the box needs
  double aspect = 1;       // width / height of the image
  double margin = 1.05;    // ratio of the picture's size to the box's
};

// Returns the unit direction of a view obliquely from above, about 35 degrees downward. `up` must not be zero. With z
// up, the view is towards +x, +y and -z.
Vec3d three_quarter_view(Vec3d up);

// Returns the camera with these axes and this lens that is nearest to `bounds` and shows all of it. `bounds` must not
// be empty. A box without extent is treated as a box of side 1. Method: in the view's axes each corner (x, y, depth z)
// requires |x - ex| <= w (z - ez) of the eye (ex, ey, ez). The maxima of x - w z and of -x - w z over all corners bound
// the eye from both sides; it can be nearest halfway between these bounds.
Camera frame_box(const Aabbd& bounds, const ViewAxes& axes, const Lens& lens);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
