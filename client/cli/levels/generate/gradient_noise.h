// Smooth seeded noise over space, the same bits on every machine: only +, -, * and floor of doubles, and whole numbers.
// For terrain and blob. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_

#include <array>
#include <cstdint>

namespace locus::cli {

// Gradient noise: -1 to 1, zero at whole coordinates, twice differentiable. Coordinates within -2^31 .. 2^31. Source:
// Perlin, Improving Noise, 2002 (its twelve gradients and its fifth-degree blend), with a hash in place of its table.
double gradient_noise(const std::array<double, 3>& point, uint64_t seed);

// Noise at once, half and so on of the first wavelength, each octave with half the weight of the one before; divided by
// the sum of the weights, so -1 to 1. Source: Musgrave, Kolb, Mace, The Synthesis and Rendering of Eroded Fractal
// Terrains, 1989. `wavelength` is a power of two, `octaves` at least 1. Cost: eight hashes an octave.
double fractal_noise(const std::array<double, 3>& point, double wavelength, int octaves, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_GRADIENT_NOISE_H_
