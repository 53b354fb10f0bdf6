#include "client/cli/extras/render/ray_image.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "absl/strings/escaping.h"
#include "absl/strings/string_view.h"
#include "client/lib/result_rows.h"
#include "client/lib/sha256.h"

namespace locus::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are hashed as they lie in memory");

class ImageHash {
 public:
  template <class T>
  ImageHash& add(const T* values, size_t count) {
    hasher_.add(values, count * sizeof(T));
    return *this;
  }
  ImageHash& add(const ImageSize& size) {
    const std::array<uint32_t, 2> sides = {size.width, size.height};
    return add(sides.data(), sides.size());
  }
  std::string hex() {
    const client::Sha256 hash = hasher_.finish();
    return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(hash.data()), hash.size()));
  }

 private:
  client::Sha256Hasher hasher_;
};

}  // namespace

RayImage::RayImage(const ImageSize& image_size)
    : size(image_size),
      t(image_size.pixels(), std::numeric_limits<float>::infinity()),
      ids(image_size.pixels(), 0),
      triangles(image_size.pixels(), client::kNoTriangle),
      normals(image_size.pixels()) {}

bool RayImage::hit_object(size_t pixel) const { return hit(pixel) && triangles[pixel] == client::kNoTriangle; }

uint64_t RayImage::hits() const {
  return static_cast<uint64_t>(std::count_if(ids.begin(), ids.end(), [](uint64_t id) { return id != 0; }));
}

std::string depth_sha256(const RayImage& image) {
  return ImageHash().add(image.size).add(image.t.data(), image.t.size()).hex();
}

std::string ids_sha256(const RayImage& image) {
  ImageHash hash;
  hash.add(image.size).add(image.ids.data(), image.ids.size());
  return hash.add(image.triangles.data(), image.triangles.size()).hex();
}

}  // namespace locus::cli
