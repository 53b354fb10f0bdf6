// Colours for values and for ids. For the painters. Functions without state. Their results are bit-identical on every
// machine, because the only function of the math library that they use is the square root.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_

#include <cstdint>

#include "client/cli/extras/render/picture.h"

namespace locus::cli {

// Colour in linear light, each component 0 .. 1. Linear colours may be added and averaged, unlike colours of type
// Colour, which are gamma-encoded.
struct Light {
  double red = 0, green = 0, blue = 0;

  friend Light operator+(Light a, Light b) { return {a.red + b.red, a.green + b.green, a.blue + b.blue}; }
  friend Light operator*(Light a, double s) { return {a.red * s, a.green * s, a.blue * s}; }
};

// Convert between linear light and gamma-encoded colours. The gamma is 2, which is close to the gamma of sRGB. Light is
// clamped to 0 .. 1.
Colour colour_of(Light light);
Light light_of(Colour colour);

// Return the colour for x from a colour map that goes from dark at 0 to bright at 1. x is clamped to 0 .. 1; NaN counts
// as 0. The maps are perceptually uniform and readable by the colour-blind: viridis (for distances) and inferno (for
// costs), each given by ten points between which colours are interpolated linearly. Source: Smith and van der Walt, the
// colour maps of matplotlib 2.0 (2015, CC0).
Colour viridis(double x);
Colour inferno(double x);

// Returns the hue of an id, 0 <= hue < 1: the fractional part of id / golden ratio, so that consecutive ids have
// clearly different hues. Source: Knuth, The Art of Computer Programming 3, 1998, 6.4.
double hue_of(uint64_t id);

// Converts hue, saturation and value, each 0 .. 1, to light. Source: Smith, Color gamut transform pairs, 1978.
Light light_of_hue(double hue, double saturation, double value);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_COLOURS_H_
