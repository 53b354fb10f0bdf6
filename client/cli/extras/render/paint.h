// Painters: convert the hits of rays to pixels. For `locus render`. Functions without state, bit-identical on every
// machine.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_

#include <cstdint>
#include <vector>

#include "client/cli/extras/render/camera.h"
#include "client/cli/extras/render/picture.h"
#include "client/cli/extras/render/ray_image.h"

namespace locus::cli {

// Range of the values that a picture's colours represent.
struct ValueScale {
  double min = 0;
  double median = 0;
  double high = 0;  // the 99th percentile: the last colour, so that a few outliers do not darken the rest
  double max = 0;
};

// Returns the scale of values in any order, all 0 for an empty vector. Linear.
ValueScale scale_of(std::vector<double> values);

// Returns the depths of the pixels that have a hit.
std::vector<double> depths_of(const RayImage& image);

// Paints hits shaded by a lamp behind the camera, above and to its left, with dark edges and haze at a distance.
// Instances are pale and objects coloured; the hue depends on the id. Shading is two-sided: a triangle's back is lit as
// its front would be. Source of the falloff: Mitchell, McTaggart and Green, Shading in Valve's Source Engine, 2006.
Picture paint_shaded(const RayImage& image, const Camera& camera);

// Paints depths in viridis, the nearest bright and the furthest dark; black = no hit.
Picture paint_depth(const RayImage& image, const ValueScale& scale);

// Paints a normal's x, y, z as red, green, blue, from -1 dark to 1 bright; dark grey = no hit.
Picture paint_normals(const RayImage& image);

// Paints each id in its own colour, objects bright and instances darker; black = no hit.
Picture paint_ids(const RayImage& image);

// Paints one value a pixel in inferno, from scale.min black to scale.high bright.
Picture paint_heat(const ImageSize& size, const std::vector<double>& values, const ValueScale& scale);

// Returns the picture reduced by `factor`: each square of `factor` x `factor` pixels is averaged in linear light. Both
// sides must be multiples of `factor`.
Picture reduced(const Picture& picture, uint32_t factor);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
