// Meshes of the object shapes at unit size. Each mesh is written once; all objects of its kind draw it, each at its own
// scale. The meshes that make up one shape form a closed surface together. Triangles are counter-clockwise seen from
// outside. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// Number of vertices of the polygon that approximates a circle. All vertices lie exactly on the shape's surface.
inline constexpr int kShapeSectors = 16;

// Returns a ball of radius 1 with its poles on the z axis.
ImportedMesh unit_ball();
// Returns the half of the unit ball with z >= 0, open below.
ImportedMesh unit_dome();
// Returns a tube of radius 1 around the z axis, z from -1 to 1, open at both ends.
ImportedMesh unit_tube();
// Returns a box of half extents 1.
ImportedMesh unit_box();
// Returns an octahedron of radius 1, the marker of a point.
ImportedMesh unit_marker();

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_UNIT_SHAPES_H_
