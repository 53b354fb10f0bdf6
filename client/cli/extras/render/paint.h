// From what rays hit to pixels. For `locus render`. Functions without state, exact on every machine.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_

#include <cstdint>
#include <vector>

#include "client/cli/extras/render/camera.h"
#include "client/cli/extras/render/picture.h"
#include "client/cli/extras/render/ray_image.h"

namespace locus::cli {

// What a value of a picture's colours stands for.
struct ValueScale {
  double min = 0;
  double median = 0;
  double high = 0;  // the 99th percentile: the last colour, so that a few outliers do not darken the rest
  double max = 0;
};

// Of the values in any order; all 0 if there are none. Linear in their number.
ValueScale scale_of(std::vector<double> values);

// The depths of the pixels that hit something.
std::vector<double> depths_of(const RayImage& image);

// Lit from over the photographer's left shoulder, with dark edges and, far off, some haze. Instances are pale and
// objects coloured, both by their ids. Two-sided: a triangle's back is lit as its front would be. Source of the
// falloff: Mitchell, McTaggart and Green, Shading in Valve's Source Engine (2006).
Picture paint_shaded(const RayImage& image, const Camera& camera);

// The nearest bright, the furthest dark, in viridis; black = nothing hit.
Picture paint_depth(const RayImage& image, const ValueScale& scale);

// A normal's x, y, z as red, green, blue, from -1 dark to 1 bright; dark grey = nothing hit.
Picture paint_normals(const RayImage& image);

// A colour an id: objects bright, instances darker; black = nothing hit.
Picture paint_ids(const RayImage& image);

// One value a pixel in inferno, from scale.min black to scale.high bright.
Picture paint_heat(const ImageSize& size, const std::vector<double>& values, const ValueScale& scale);

// Each `factor` x `factor` pixels averaged to one, by light. Both sides are multiples of `factor`.
Picture reduced(const Picture& picture, uint32_t factor);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PAINT_H_
