// Hits of a picture's rays, stored in columns with one entry per pixel, row by row from the upper left. For the
// painters, and for tests that compare pictures. Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_RAY_IMAGE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_RAY_IMAGE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/extras/render/camera.h"
#include "core/geometry/vec3.h"

namespace locus::cli {

// Work of one ray: number of tree nodes visited, of grid cells visited, and of triangles and objects tested.
struct RayWork {
  uint64_t nodes = 0;
  uint64_t cells = 0;
  uint64_t tests = 0;
};

struct RayImage {
  ImageSize size;
  std::vector<float> t;             // depth in world units; +infinity = no hit
  std::vector<uint64_t> ids;        // 0 = no hit
  std::vector<uint32_t> triangles;  // client::kNoTriangle = hit on an object, or no hit
  std::vector<Vec3f> normals;       // unit vectors in world axes, as the server returns them; 0 = no hit
  std::vector<RayWork> work;        // empty unless requested

  explicit RayImage(const ImageSize& image_size);

  bool hit(size_t pixel) const { return ids[pixel] != 0; }
  bool hit_object(size_t pixel) const;
  uint64_t hits() const;
};

// Returns the SHA-256, in hexadecimal, of these values in little-endian order: width and height as uint32, then t as
// float32 for each pixel.
std::string depth_sha256(const RayImage& image);
// Returns the SHA-256, in hexadecimal, of these values in little-endian order: width and height as uint32, then the ids
// as uint64 for each pixel, then the triangles as uint32 for each pixel.
std::string ids_sha256(const RayImage& image);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_RAY_IMAGE_H_
