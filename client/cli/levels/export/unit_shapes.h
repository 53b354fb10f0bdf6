// The shapes of objects at unit size, as meshes: written once and drawn by every object of the kind, scaled. Closed
// together and counter-clockwise seen from outside. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// Corners of a circle that a curved shape is cut into; all corners lie on the shape.
inline constexpr int kShapeSectors = 16;

// Radius 1; poles on the z axis.
ImportedMesh unit_ball();
// The half of the ball with z >= 0, open below.
ImportedMesh unit_dome();
// Radius 1, z from -1 to 1, open at both ends.
ImportedMesh unit_tube();
// Half extents 1.
ImportedMesh unit_box();
// An octahedron of radius 1, for a thing without a size.
ImportedMesh unit_marker();

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_
