// Placement of a camera at the nearest position from which the whole of a box is visible. For `locus render` without
// --eye. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_

#include "client/cli/extras/render/camera.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// Properties of a camera other than its position and axes.
struct Lens {
  Projection projection = Projection::kPerspective;
  double half_height = 1;  // as in Camera; 0 = chosen so that the box fits (orthographic only)
  double aspect = 1;       // width / height of the image
  double margin = 1.05;    // ratio of the picture's size to the size of the box in it
};

// Returns the unit direction of a view that is inclined downwards by about 35 degrees. `up` must not be zero. If `up`
// is z, the view is towards +x, +y and -z.
Vec3d three_quarter_view(Vec3d up);

// Returns the camera with these axes and this lens that is nearest to `bounds` and shows all of it. Exception: if the
// lens is orthographic and its half_height is not 0, the picture can be too small to show all of it. `bounds` must not
// be empty. A box that is a single point is treated as a box of side 1. Method for perspective projection: all
// coordinates are along the view's axes (right, up, forward), and w is the slope of the picture's left and right edges.
// Seen from the eye (ex, ey, ez), a corner (x, y, z) lies between these edges if |x - ex| <= w (z - ez). Over all
// corners, let a be the maximum of x - w z, and b the maximum of -x - w z. Then all corners lie between the edges if
// a + w ez <= ex <= -b - w ez. The nearer the eye is to the box, the larger is ez. The largest possible ez is the one
// at which both bounds of ex are equal. The condition in y gives a second maximum of ez; the smaller of the two maxima
// is used. Finally the distance to the box's centre is multiplied by the margin of the lens.
Camera frame_box(const Aabbd& bounds, const ViewAxes& axes, const Lens& lens);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
