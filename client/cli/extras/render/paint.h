// Painters that convert the hits of rays to pixels. For `locus render`. Functions without state. Their results are
// bit-identical on every machine.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_

#include <cstdint>
#include <vector>

#include "client/cli/extras/render/camera.h"
#include "client/cli/extras/render/picture.h"
#include "client/cli/extras/render/ray_image.h"

namespace locus::cli {

// Range of the values that the colours of a picture represent.
struct ValueScale {
  double min = 0;
  double median = 0;
  double high = 0;  // 99th percentile; paint_heat() is brightest from this value up, so outliers do not darken the rest
  double max = 0;
};

// Returns the scale of `values`, which may have any order. All members are 0 if there are no values. Cost: linear.
ValueScale scale_of(std::vector<double> values);

// Returns the depths of all pixels that have a hit.
std::vector<double> depths_of(const RayImage& image);

// Paints hits shaded by a lamp that is behind the camera, above and to its left, with dark edges and with haze at a
// distance. Instances are pale, objects coloured; the hue depends on the id. Shading is two-sided: the back of a
// triangle is lit like its front. Source of the diffuse term (half Lambert): Mitchell, McTaggart and Green, Shading in
// Valve's Source Engine, 2006.
Picture paint_shaded(const RayImage& image, const Camera& camera);

// Paints depths with the colour map viridis: the nearest bright, the furthest dark. Pixels without a hit are black.
Picture paint_depth(const RayImage& image, const ValueScale& scale);

// Paints the normal's x, y, z as red, green, blue: -1 is dark, 1 bright. Pixels without a hit are dark grey.
Picture paint_normals(const RayImage& image);

// Paints each id in its own colour, objects bright and instances darker. Pixels without a hit are black.
Picture paint_ids(const RayImage& image);

// Paints one value per pixel with the colour map inferno, from black at scale.min to bright at scale.high.
Picture paint_heat(const ImageSize& size, const std::vector<double>& values, const ValueScale& scale);

// Returns the picture reduced by `factor` in both directions: each square of `factor` x `factor` pixels becomes their
// average in linear light. Width and height must be multiples of `factor`.
Picture reduced(const Picture& picture, uint32_t factor);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
