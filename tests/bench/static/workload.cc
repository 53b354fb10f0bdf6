#include "tests/bench/static/workload.h"

#include <algorithm>
#include <cmath>

#include "client/cli/levels/generate/splitmix64.h"

namespace locus::bench {
namespace {

class Draws {
 public:
  explicit Draws(uint64_t seed) : numbers_(seed) {}
  uint64_t next() { return numbers_.next(); }
  float unit() { return static_cast<float>(numbers_.next() >> 40) * 0x1p-24f; }
  Vec3f point_in(const Aabbf& bounds) {
    Vec3f point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = bounds.min[axis] + unit() * (bounds.max[axis] - bounds.min[axis]);
    return point;
  }

 private:
  cli::SplitMix64 numbers_;
};

Vec3f any_direction(Draws& draws) {
  const float z = 1 - 2 * draws.unit();
  const float angle = 6.28318530718f * draws.unit();
  const float radius = std::sqrt(std::max(0.0f, 1 - z * z));
  const Vec3f direction = {radius * std::cos(angle), radius * std::sin(angle), z};
  return direction * (1 / std::sqrt(squared_length(direction)));
}

Vec3f on_surface(const BenchMesh& mesh, Draws& draws) {
  const Triangle& triangle = mesh.triangles[draws.next() % mesh.triangles.size()];
  const float u = std::sqrt(draws.unit());
  const float w = draws.unit();
  return triangle.a * (1 - u) + triangle.b * (u * (1 - w)) + triangle.c * (u * w);
}

struct Camera {
  Vec3d eye, forward, right, up;
  double tangent = 0;  // tangent of half the vertical field of view
};

Camera camera_of(const BenchMesh& mesh) {
  constexpr double kHalfView = 25 * 3.14159265358979 / 180;
  Camera camera;
  const Vec3d away = normalized(Vec3d{0.6, 0.45, 0.66});
  const Vec3d centre = (to_double(mesh.bounds.min) + to_double(mesh.bounds.max)) * 0.5;
  camera.eye = centre + away * (double{mesh.diagonal} * 0.75);
  camera.forward = -away;
  camera.right = normalized(cross(camera.forward, Vec3d{0, 1, 0}));
  camera.up = cross(camera.right, camera.forward);
  camera.tangent = std::tan(kHalfView);
  return camera;
}

RayQuery through_pixel(const Camera& camera, int x, int y, int width, int height) {
  const double right = (2 * (x + 0.5) / width - 1) * camera.tangent * width / height;
  const double up = (1 - 2 * (y + 0.5) / height) * camera.tangent;
  const Vec3d direction = camera.forward + camera.right * right + camera.up * up;
  return {to_float(camera.eye), kEndless, to_float(direction * (1 / std::sqrt(squared_length(direction))))};
}

}  // namespace

std::vector<RayQuery> random_rays(const BenchMesh& mesh, size_t count, uint64_t seed, float t_max) {
  Draws draws(seed);
  std::vector<RayQuery> rays(count);
  for (RayQuery& ray : rays) {
    ray.origin = draws.point_in(mesh.bounds);
    ray.direction = any_direction(draws);
    ray.t_max = t_max;
  }
  return rays;
}

std::vector<RayQuery> camera_rays(const BenchMesh& mesh, int width, int height) {
  constexpr int kTile = 4;
  const Camera camera = camera_of(mesh);
  std::vector<RayQuery> rays;
  rays.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int tile_y = 0; tile_y < height; tile_y += kTile)
    for (int tile_x = 0; tile_x < width; tile_x += kTile)
      for (int y = tile_y; y < tile_y + kTile; ++y)
        for (int x = tile_x; x < tile_x + kTile; ++x) rays.push_back(through_pixel(camera, x, y, width, height));
  return rays;
}

std::vector<Ballf> balls(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction) {
  Draws draws(seed);
  std::vector<Ballf> result(count);
  for (size_t i = 0; i < count; ++i) {
    result[i].center = i % 2 == 0 ? on_surface(mesh, draws) : draws.point_in(mesh.bounds);
    result[i].radius = fraction * mesh.diagonal;
  }
  return result;
}

std::vector<Obbf> boxes(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction) {
  Draws draws(seed ^ 0xB0B);
  std::vector<Obbf> result;
  result.reserve(count);
  for (const Ballf& centre : balls(mesh, count, seed, fraction)) {
    Obbf box;
    box.center = centre.center;
    for (int axis = 0; axis < 3; ++axis) box.half[axis] = fraction * mesh.diagonal * (0.5f + draws.unit());
    result.push_back(box);
  }
  return result;
}

}  // namespace locus::bench
