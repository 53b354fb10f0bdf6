#include "client/cli/extras/render/colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace locus::cli {
namespace {

double luminance(Colour colour) {
  const Light light = light_of(colour);
  return 0.2126 * light.red + 0.7152 * light.green + 0.0722 * light.blue;
}

TEST(ColourTest, EveryStoredColourSurvivesConversionToLightAndBack) {
  for (int value = 0; value < 256; ++value) {
    const auto byte = static_cast<uint8_t>(value);
    const Colour colour = {byte, static_cast<uint8_t>(255 - byte), 7};
    EXPECT_EQ(colour_of(light_of(colour)), colour);
  }
}

TEST(ColourTest, LightBeyondTheRangeIsCut) { EXPECT_EQ(colour_of({-1, 0.25, 9}), (Colour{0, 128, 255})); }

TEST(ColourMapTest, EndsAreTheMapsOwn) {
  EXPECT_EQ(viridis(0), (Colour{0x44, 0x01, 0x54}));
  EXPECT_EQ(viridis(1), (Colour{0xFD, 0xE7, 0x25}));
  EXPECT_EQ(inferno(0), (Colour{0x00, 0x00, 0x04}));
  EXPECT_EQ(inferno(1), (Colour{0xFC, 0xFF, 0xA4}));
}

TEST(ColourMapTest, GetsBrighterAllTheWay) {
  for (const auto map : {viridis, inferno}) {
    for (int step = 1; step <= 100; ++step) {
      EXPECT_GT(luminance(map(step / 100.0)), luminance(map((step - 1) / 100.0))) << step;
    }
  }
}

TEST(ColourMapTest, ValuesOutsideTheRangeAreClampedAndNanIsZero) {
  const double kInfinity = std::numeric_limits<double>::infinity();
  for (const auto map : {viridis, inferno}) {
    EXPECT_EQ(map(-3), map(0));
    EXPECT_EQ(map(-kInfinity), map(0));
    EXPECT_EQ(map(2), map(1));
    EXPECT_EQ(map(kInfinity), map(1));
    EXPECT_EQ(map(std::nan("")), map(0));
  }
}

TEST(HueTest, ConsecutiveIdsHaveDistantHues) {
  for (uint64_t first : {uint64_t{1}, uint64_t{1'000'000}, uint64_t{1} << 63}) {
    std::vector<double> hues;
    for (uint64_t id = first; id < first + 8; ++id) hues.push_back(hue_of(id));
    std::sort(hues.begin(), hues.end());
    EXPECT_GE(hues.front(), 0);
    EXPECT_LT(hues.back(), 1);
    for (size_t i = 1; i < hues.size(); ++i) EXPECT_GT(hues[i] - hues[i - 1], 0.04) << first;
  }
}

TEST(HueTest, PureHuesHaveTheExpectedColours) {
  EXPECT_EQ(colour_of(light_of_hue(0, 1, 1)), (Colour{255, 0, 0}));
  EXPECT_EQ(colour_of(light_of_hue(1.0 / 3, 1, 1)), (Colour{0, 255, 0}));
  EXPECT_EQ(colour_of(light_of_hue(2.0 / 3, 1, 1)), (Colour{0, 0, 255}));
  EXPECT_EQ(colour_of(light_of_hue(0.5, 1, 1)), (Colour{0, 255, 255}));
  EXPECT_EQ(colour_of(light_of_hue(0.7, 0, 1)), (Colour{255, 255, 255}));
  EXPECT_EQ(colour_of(light_of_hue(0.7, 1, 0)), (Colour{0, 0, 0}));
}

}  // namespace
}  // namespace locus::cli
