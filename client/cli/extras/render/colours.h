// Colours for numbers and for names. For the painters. Functions without state; exact on every machine: no function of
// libm but the square root.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_

#include <cstdint>

#include "client/cli/extras/render/picture.h"

namespace locus::cli {

// Light, 0 .. 1 a component: what may be added and averaged.
struct Light {
  double red = 0, green = 0, blue = 0;

  friend Light operator+(Light a, Light b) { return {a.red + b.red, a.green + b.green, a.blue + b.blue}; }
  friend Light operator*(Light a, double s) { return {a.red * s, a.green * s, a.blue * s}; }
};

// Between light and stored colours, by a gamma of 2, close to sRGB's. Light beyond 0 .. 1 is cut.
Colour colour_of(Light light);
Light light_of(Colour colour);

// A map from dark to bright for 0 <= x <= 1 (cut to it; NaN is 0), even to the eye and readable by the colour-blind:
// straight lines between ten points of viridis, for distances, or of inferno, for costs.
// Source: Smith and van der Walt, the colour maps of matplotlib 2.0 (2015, CC0).
Colour viridis(double x);
Colour inferno(double x);

// A hue that tells an id from its neighbours: the fraction of id / golden ratio (Knuth, The Art of Computer Programming
// 3, 1998, 6.4), so that ids in a row lie far apart on the circle. 0 <= hue < 1.
double hue_of(uint64_t id);

// Smith, Color gamut transform pairs (1978): hue, saturation and value, each 0 .. 1, as light.
Light light_of_hue(double hue, double saturation, double value);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_
