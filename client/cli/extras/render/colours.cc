#include "client/cli/extras/render/colours.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace locus::cli {
namespace {

constexpr size_t kStops = 10;

constexpr std::array<Colour, kStops> kViridis = {{{0x44, 0x01, 0x54},
                                                  {0x48, 0x28, 0x78},
                                                  {0x3E, 0x4A, 0x89},
                                                  {0x31, 0x68, 0x8E},
                                                  {0x26, 0x82, 0x8E},
                                                  {0x1F, 0x9E, 0x89},
                                                  {0x35, 0xB7, 0x79},
                                                  {0x6D, 0xCD, 0x59},
                                                  {0xB4, 0xDE, 0x2C},
                                                  {0xFD, 0xE7, 0x25}}};

constexpr std::array<Colour, kStops> kInferno = {{{0x00, 0x00, 0x04},
                                                  {0x1B, 0x0C, 0x42},
                                                  {0x4B, 0x0C, 0x6B},
                                                  {0x78, 0x1C, 0x6D},
                                                  {0xA5, 0x2C, 0x60},
                                                  {0xCF, 0x44, 0x46},
                                                  {0xED, 0x69, 0x25},
                                                  {0xFB, 0x9A, 0x06},
                                                  {0xF7, 0xD0, 0x3C},
                                                  {0xFC, 0xFF, 0xA4}}};

uint8_t byte_of(double value) { return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); }

uint8_t between(uint8_t a, uint8_t b, double weight) { return byte_of(a + (b - a) * weight); }

Colour interpolated(const std::array<Colour, kStops>& stops, double x) {
  const double position = x > 0 ? std::min(x, 1.0) * (kStops - 1) : 0;
  const size_t below = std::min(static_cast<size_t>(position), kStops - 2);
  const double weight = position - static_cast<double>(below);
  const Colour a = stops[below], b = stops[below + 1];
  return {between(a.red, b.red, weight), between(a.green, b.green, weight), between(a.blue, b.blue, weight)};
}

double stored(double light) { return 255 * std::sqrt(std::clamp(light, 0.0, 1.0)); }
double squared(uint8_t stored) { return (stored / 255.0) * (stored / 255.0); }

}  // namespace

Colour colour_of(Light light) {
  return {byte_of(stored(light.red)), byte_of(stored(light.green)), byte_of(stored(light.blue))};
}

Light light_of(Colour colour) { return {squared(colour.red), squared(colour.green), squared(colour.blue)}; }

Colour viridis(double x) { return interpolated(kViridis, x); }
Colour inferno(double x) { return interpolated(kInferno, x); }

double hue_of(uint64_t id) {
  constexpr uint64_t kInverseGoldenRatio = 0x9E3779B97F4A7C15u;  // scaled by 2^64
  return static_cast<double>((id * kInverseGoldenRatio) >> 40) * 0x1p-24;
}

Light light_of_hue(double hue, double saturation, double value) {
  const double sector = 6 * hue;
  const double red = std::clamp(std::abs(sector - 3) - 1, 0.0, 1.0);
  const double green = std::clamp(2 - std::abs(sector - 2), 0.0, 1.0);
  const double blue = std::clamp(2 - std::abs(sector - 4), 0.0, 1.0);
  const Light pure = {red, green, blue};
  return (Light{1, 1, 1} * (1 - saturation) + pure * saturation) * value;
}

}  // namespace locus::cli
