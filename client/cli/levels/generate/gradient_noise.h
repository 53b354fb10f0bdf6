// Smooth seeded noise in three dimensions. It is bit-identical on every machine, because it uses only integers and the
// operations +, -, * and floor on doubles. For terrain and blob. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_

#include <array>
#include <cstdint>

namespace locus::cli {

// Returns gradient noise at `point`: a value in -1 .. 1, zero at integer coordinates, twice differentiable. Coordinates
// must be within -2^31 .. 2^31. Source: Perlin, Improving Noise, 2002 (its twelve gradients and its fifth-degree
// blend), with a hash instead of the permutation table.
double gradient_noise(const std::array<double, 3>& point, uint64_t seed);

// Returns the weighted mean of `octaves` layers of gradient noise, in -1 .. 1. The first layer has wavelength
// `wavelength`, a power of two. Each further layer has half the wavelength and half the weight of the layer before.
// `octaves` is at least 1. Source: Musgrave, Kolb, Mace, The Synthesis and Rendering of Eroded Fractal Terrains, 1989.
// Cost: eight hashes per octave.
double fractal_noise(const std::array<double, 3>& point, double wavelength, int octaves, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_
