#include "client/cli/extras/render/paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "client/cli/extras/render/colours.h"

namespace locus::cli {
namespace {

constexpr double kMaxHaze = 0.45;  // share of haze in the colour of the furthest hit
constexpr Light kHaze = {0.09, 0.12, 0.18};

template <class ColourOfPixel>
Picture paint_each(const ImageSize& size, const ColourOfPixel& colour) {
  Picture picture{size, {}};
  picture.pixels.reserve(size.pixels());
  for (size_t pixel = 0; pixel < size.pixels(); ++pixel) picture.pixels.push_back(colour(pixel));
  return picture;
}

// Returns the colour, before shading, of the object or instance that is hit at a pixel.
Light material_of(const RayImage& image, size_t pixel) {
  const double hue = hue_of(image.ids[pixel]);
  return image.hit_object(pixel) ? light_of_hue(hue, 0.9, 0.95) : light_of_hue(hue, 0.08, 0.6);
}

class Shader {
 public:
  Shader(const RayImage& image, const Camera& camera)
      : image_(image),
        camera_(camera),
        depths_(scale_of(depths_of(image))),
        lamp_(normalized(camera.axes.up * 0.9 - camera.axes.right * 0.6 - camera.axes.forward * 0.6)) {}

  Colour operator()(size_t pixel) const {
    const uint32_t column = static_cast<uint32_t>(pixel % image_.size.width);
    const uint32_t row = static_cast<uint32_t>(pixel / image_.size.width);
    if (!image_.hit(pixel)) return background(row);
    const Vec3d view = normalized(to_double(ray_through(camera_, image_.size, column, row).direction));
    const Vec3d outward = to_double(image_.normals[pixel]);
    const Vec3d normal = dot(outward, view) > 0 ? -outward : outward;
    const double wrapped = 0.5 + 0.5 * dot(normal, lamp_);
    Light light = material_of(image_, pixel) * (0.08 + 0.92 * wrapped * wrapped);
    if (image_.hit_object(pixel)) light = light + Light{1, 1, 1} * (0.35 * gloss(normal, view));
    return colour_of(hazy(light * edge(pixel, column, row), image_.t[pixel]));
  }

 private:
  Colour background(uint32_t row) const {
    const double down = static_cast<double>(row) / image_.size.height;
    return colour_of(Light{0.012, 0.020, 0.040} * (1 - down) + Light{0.055, 0.075, 0.110} * down);
  }

  // Returns `light` mixed with haze in proportion to the distance t, so that a near and a far surface that are adjacent
  // in the picture differ in colour.
  Light hazy(Light light, float t) const {
    const double range = depths_.max - depths_.min;
    const double haze = range > 0 ? kMaxHaze * (double{t} - depths_.min) / range : 0;
    return light * (1 - haze) + kHaze * haze;
  }

  // Returns the strength of the highlight: the 32nd power of the cosine of the angle between the normal and the half
  // vector of the directions to the lamp and the eye. Source: Blinn, Models of Light Reflection for Computer
  // Synthesized Pictures, 1977.
  double gloss(Vec3d normal, Vec3d view) const {
    const double cosine = std::max(0.0, dot(normal, normalized(lamp_ - view)));
    double power = cosine;
    for (int squaring = 0; squaring < 5; ++squaring) power *= power;
    return power;
  }

  // Returns the factor by which a pixel is darkened because it is at an edge. The factor is below 1 if a neighbouring
  // pixel shows a surface further away, or if the surface bends sharply between the two pixels.
  double edge(size_t pixel, uint32_t column, uint32_t row) const {
    double factor = 1;
    const uint32_t width = image_.size.width;
    if (column > 0) factor = std::min(factor, step_to(pixel, pixel - 1));
    if (column + 1 < width) factor = std::min(factor, step_to(pixel, pixel + 1));
    if (row > 0) factor = std::min(factor, step_to(pixel, pixel - width));
    if (row + 1 < image_.size.height) factor = std::min(factor, step_to(pixel, pixel + width));
    return factor;
  }

  double step_to(size_t pixel, size_t neighbour) const {
    if (image_.ids[pixel] != image_.ids[neighbour]) return image_.t[pixel] < image_.t[neighbour] ? 0.35 : 1;
    if (image_.t[neighbour] > 1.1f * image_.t[pixel]) return 0.5;
    return dot(image_.normals[pixel], image_.normals[neighbour]) < 0.8f && !image_.hit_object(pixel) ? 0.75 : 1;
  }

  const RayImage& image_;
  const Camera& camera_;
  const ValueScale depths_;
  const Vec3d lamp_;  // unit vector in the direction of the lamp
};

double value_at(std::vector<double>& values, double share) {
  const auto position = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), position, values.end());
  return *position;
}

uint8_t signed_byte(float component) { return static_cast<uint8_t>(std::clamp(127.5f * (component + 1), 0.f, 255.f)); }

}  // namespace

ValueScale scale_of(std::vector<double> values) {
  if (values.empty()) return {};
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  ValueScale scale = {.min = *min, .median = 0, .high = 0, .max = *max};
  scale.median = value_at(values, 0.5);
  scale.high = value_at(values, 0.99);
  return scale;
}

std::vector<double> depths_of(const RayImage& image) {
  std::vector<double> depths;
  for (size_t pixel = 0; pixel < image.t.size(); ++pixel) {
    if (image.hit(pixel)) depths.push_back(double{image.t[pixel]});
  }
  return depths;
}

Picture paint_shaded(const RayImage& image, const Camera& camera) {
  return paint_each(image.size, Shader(image, camera));
}

Picture paint_depth(const RayImage& image, const ValueScale& scale) {
  const double range = scale.max > scale.min ? scale.max - scale.min : 1;
  return paint_each(image.size, [&](size_t pixel) {
    return image.hit(pixel) ? viridis((scale.max - double{image.t[pixel]}) / range) : Colour{};
  });
}

Picture paint_normals(const RayImage& image) {
  return paint_each(image.size, [&](size_t pixel) {
    const Vec3f n = image.normals[pixel];
    return image.hit(pixel) ? Colour{signed_byte(n.x), signed_byte(n.y), signed_byte(n.z)} : Colour{24, 24, 24};
  });
}

Picture paint_ids(const RayImage& image) {
  return paint_each(image.size, [&](size_t pixel) {
    if (!image.hit(pixel)) return Colour{};
    return colour_of(light_of_hue(hue_of(image.ids[pixel]), 0.8, image.hit_object(pixel) ? 0.9 : 0.3));
  });
}

Picture paint_heat(const ImageSize& size, const std::vector<double>& values, const ValueScale& scale) {
  const double range = scale.high > scale.min ? scale.high - scale.min : 1;
  return paint_each(size, [&](size_t pixel) { return inferno((values[pixel] - scale.min) / range); });
}

Picture reduced(const Picture& picture, uint32_t factor) {
  const ImageSize size = {picture.size.width / factor, picture.size.height / factor};
  const double share = 1.0 / (factor * factor);
  return paint_each(size, [&](size_t pixel) {
    const size_t column = pixel % size.width * factor, row = pixel / size.width * factor;
    Light sum;
    for (size_t y = row; y < row + factor; ++y)
      for (size_t x = column; x < column + factor; ++x)
        sum = sum + light_of(picture.pixels[y * picture.size.width + x]);
    return colour_of(sum * share);
  });
}

}  // namespace locus::cli
