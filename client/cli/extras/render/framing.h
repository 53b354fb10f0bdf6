// Cameras that frame a box: where to stand so that all of it is in the picture, and no further away than that. For
// `locus render` without --eye. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_

#include "client/cli/extras/render/camera.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// How a camera projects, before it is known where it stands.
struct Lens {
  Projection projection = Projection::kPerspective;
  double half_height = 1;  // as Camera::half_height; orthographic: 0 = what the box takes
  double aspect = 1;       // width / height of the image
  double margin = 1.05;    // the box takes 1 / margin of the picture
};

// The direction of a view from above and from a side, at about 35 degrees: unit, for an `up` that is not zero. With z
// up it looks along +x, +y and down.
Vec3d three_quarter_view(Vec3d up);

// The camera of these axes and this lens that shows all of `bounds`, which is not empty, nearest to it. A box without
// extent is seen from 1 away.
// Method: in the view's axes each corner (x, y, depth z) wants |x - ex| <= w (z - ez). The largest x - w z and -x - w z
// of all corners bound the eye from both sides: halfway between them it may stand nearest.
Camera frame_box(const Aabbd& bounds, const ViewAxes& axes, const Lens& lens);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_FRAMING_H_
