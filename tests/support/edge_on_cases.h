// Rays that meet a triangle at an angle whose sine is at most 2^-36, each with the reference's answer. When rays were
// tested in double only, these rays were answered wrongly. The ray proof (proof/ray_proof.h) found them with
// 100,000,000 rays and seed 4. Plain data.
#ifndef LOCUS_TESTS_SUPPORT_EDGE_ON_CASES_H_
#define LOCUS_TESTS_SUPPORT_EDGE_ON_CASES_H_

#include <cmath>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/geometry/ray_triangle.h"
#include "core/geometry/transform.h"

namespace locus::test {

struct EdgeOnCase {
  Triangle triangle;
  Vec3d translation;
  Vec3d origin, direction;  // in world axes
  Cull cull;
  double t;
};

inline constexpr double kNothing = -1;  // expected t if the reference has no hit

inline const EdgeOnCase kEdgeOnCases[] = {
    {{{0x1.2p+4f, 0x1.e4p+6f, 0}, {0x1.6p+4f, 0x1.e4p+6f, 0x1.18p+5f}, {0x1.6p+4f, 0x1.e4p+6f, 0}},
     {-0x1.b8c311192c5f7p+5, 0x1.2b5009a48d282p+5, -0x1.08ab25b50cdfep+6},
     {-0x1.14c311192c5f7p+5, 0x1.3cd40269234ap+7, -0x1.41564b6a19bfcp+5},
     {-0x1p-1, -0x1p-46, 0x1p-1},
     Cull::kNone,
     kNothing},
    {{{0x1.009fp+16f, -0x1.ff758p+16f, 0x1p+15f},
      {0x1.00a1p+16f, -0x1.ff728p+16f, 0x1p+15f},
      {0x1.009fp+16f, -0x1.ff728p+16f, 0x1p+15f}},
     {0x1.2fdcc85df9dd2p+5, 0x1.269576f8aab3p+2, 0x1.56c238d9c02f4p+4},
     {0x1.00c665990bbf4p+16, -0x1.ff6f6faa241d5p+16, 0x1.002ad8471b38p+15},
     {0x1.164f8cp-1, -0x1.734f16p+0, -0x1p-38},
     Cull::kNone,
     kNothing},
    {{{0x1.3ep+7f, 0x1.b4p+6f, 0}, {0x1.3ep+7f, 0x1.b4p+6f, 0x1.6p+4f}, {0x1.42p+7f, 0x1.b4p+6f, 0x1.6p+4f}},
     {-0x1.b8c311192c5f7p+5, 0x1.2b5009a48d282p+5, -0x1.08ab25b50cdfep+6},
     {0x1.a59e777369d04p+6, 0x1.24d40269234ap+7, -0x1.b5564b6a19bfcp+5},
     {0x1.316b82p+4, -0x1.316b82p-41, 0},
     Cull::kNone,
     kNothing},
    {{{0x1.006ap+16f, -0x1.ffc88p+16f, 0x1p+15f},
      {0x1.0072p+16f, -0x1.ffc88p+16f, 0x1p+15f},
      {0x1.0072p+16f, -0x1.ffbf8p+16f, 0x1p+15f}},
     {0x1.2fdcc85df9dd2p+5, 0x1.269576f8aab3p+2, 0x1.56c238d9c02f4p+4},
     {0x1.0091fb990bbf4p+16, -0x1.ffc0e5aa241d5p+16, 0x1.002ad8471b38p+15},
     {-0x1p-1, 0x1p-1, -0x1p-38},
     Cull::kNone,
     kNothing},
    {{{0x1.0012p+16f, -0x1.ffe68p+16f, 0x1p+15f},
      {0x1.0016p+16f, -0x1.ffe68p+16f, 0x1.003cp+15f},
      {0x1.0016p+16f, -0x1.ffe68p+16f, 0x1p+15f}},
     {0x1.7a049140f8c9p+2, -0x1.0b7b15c54221dp+6, -0x1.f604a4940e253p+5},
     {0x1.001986124503ep+16, -0x1.0014af62b8a84p+17, 0x1.ff41adadb5f8fp+14},
     {0x1.ac0d5ap-3, 0x1p-36, 0x1.855becp+3},
     Cull::kNone,
     kNothing},
    {{{0x1.38p+5f, 0x1.bcp+6f, 0}, {0x1.38p+5f, 0x1.bcp+6f, 0x1.38p+5f}, {0x1.48p+5f, 0x1.bcp+6f, 0x1.38p+5f}},
     {-0x1.3b64796a283a4p+6, 0x1.e10356952eb1cp+4, -0x1.25b3d164263b3p+5},
     {-0x1.32c8f2d450748p+5, 0x1.1a206ad2a5d64p+7, -0x1.76cf459098eccp+3},
     {0x1p-1, 0x1p-46, 0},
     Cull::kNone,
     kNothing},
    {{{0x1.0009p+16f, -0x1.ff77p+16f, 0x1p+15f},
      {0x1.000bp+16f, -0x1.ff77p+16f, 0x1.001ap+15f},
      {0x1.000bp+16f, -0x1.ff77p+16f, 0x1p+15f}},
     {-0x1.90e17bfa7a3c6p+5, -0x1.1c30abcdbb65p+4, -0x1.14654682d5be1p+6},
     {0x1.ffaf07a101617p+15, -0x1.ff88c30abcdbbp+16, 0x1.fee060b97d2a4p+14},
     {0x1.a7a816p+9, -0x1.71b09p-27, 0x1.2d063p+13},
     Cull::kNone,
     0.0005335978428910965},
    {{{0x1.00558p+16f, -0x1.fff78p+16f, 0x1p+15f},
      {0x1.00558p+16f, -0x1.fff78p+16f, 0x1.0014p+15f},
      {0x1.005e8p+16f, -0x1.fff78p+16f, 0x1.0014p+15f}},
     {-0x1.335a92983aa15p+6, 0x1.b54b0c362c54cp+5, 0x1.3e68649130b4ap+6},
     {0x1.0011555b59f15p+16, -0x1.ffc0d69e793a7p+16, 0x1.00b7723248986p+15},
     {-0x1.efd65p+11, -0x1.05c18ep-27, -0x1.f5e56cp+11},
     Cull::kNone,
     0.0006454303449962768},
    {{{0x1.009dp+16f, -0x1.ff58p+16f, 0x1p+15f},
      {0x1.00a3p+16f, -0x1.ff58p+16f, 0x1.0008p+15f},
      {0x1.00a3p+16f, -0x1.ff58p+16f, 0x1p+15f}},
     {0x1.2fdcc85df9dd2p+5, 0x1.269576f8aab3p+2, 0x1.56c238d9c02f4p+4},
     {0x1.00c915990bbf4p+16, -0x1.ff5365aa241d5p+16, 0x1.0032f2471b38p+15},
     {-0x1.a8309ap+1, -0x1p-36, -0x1.cee21ap+1},
     Cull::kNone,
     0.3251953125},
    {{{0x1.0092p+16f, -0x1.ff898p+16f, 0x1p+15f},
      {0x1.0092p+16f, -0x1.ff898p+16f, 0x1.0032p+15f},
      {0x1.009ap+16f, -0x1.ff898p+16f, 0x1.0032p+15f}},
     {0x1.2fdcc85df9dd2p+5, 0x1.269576f8aab3p+2, 0x1.56c238d9c02f4p+4},
     {0x1.00b89f990bbf4p+16, -0x1.ff84e5aa241d5p+16, 0x1.006d06471b38p+15},
     {0x1.294e04p-10, -0x1.97f80cp-47, -0x1.5148f8p-6},
     Cull::kNone,
     417.91417474409286},
    {{{0x1.fffep+15f, -0x1.ff82p+16f, 0x1p+15f},
      {0x1.0001p+16f, -0x1.ff7ap+16f, 0x1p+15f},
      {0x1.fffep+15f, -0x1.ff7ap+16f, 0x1p+15f}},
     {-0x1.335a92983aa15p+6, 0x1.b54b0c362c54cp+5, 0x1.3e68649130b4ap+6},
     {0x1.ff68beb6b3e2bp+15, -0x1.ff409a9e793a7p+16, 0x1.009f343248986p+15},
     {-0x1.47454ap+3, -0x1.92a3c6p+5, -0x1.16b5cap-35},
     Cull::kNone,
     0.08162602968452189},
    {{{0x1.00428p+16f, -0x1.ff89p+16f, 0x1p+15f},
      {0x1.00498p+16f, -0x1.ff89p+16f, 0x1.000ep+15f},
      {0x1.00498p+16f, -0x1.ff89p+16f, 0x1p+15f}},
     {0x1.7a049140f8c9p+2, -0x1.0b7b15c54221dp+6, -0x1.f604a4940e253p+5},
     {0x1.005200124503ep+16, -0x1.ffcbdec571509p+16, 0x1.ff1345adb5f8fp+14},
     {-0x1.f7088ep+5, 0x1.c3f9e4p-34, -0x1.4da792p+4},
     Cull::kFront,
     0.06679003081222772},
    {{{0x1.00a58p+16f, -0x1.ff528p+16f, 0x1p+15f},
      {0x1.00a58p+16f, -0x1.ff528p+16f, 0x1.0034p+15f},
      {0x1.00ae8p+16f, -0x1.ff528p+16f, 0x1.0034p+15f}},
     {0x1.7a049140f8c9p+2, -0x1.0b7b15c54221dp+6, -0x1.f604a4940e253p+5},
     {0x1.00ad10124503ep+16, -0x1.ff955ec571509p+16, 0x1.fefaadadb5f8fp+14},
     {-0x1.b1b4e2p-2, 0x1p-36, 0x1.bce72ap+4},
     Cull::kFront,
     0.4716796875},
};

// Returns a description of the first wrong answer of TriangleRay; empty if there is none.
inline std::string edge_on_difference() {
  int number = 0;
  for (const EdgeOnCase& each : kEdgeOnCases) {
    const Transform transform = make_transform(each.translation, {}, 1);
    const TriangleRay ray(transform, each.origin, each.direction, each.cull);
    const std::optional<TriangleHit> hit = ray.hit(each.triangle);
    const std::string name = absl::StrCat("case ", number++, ": ");
    if (hit.has_value() != (each.t != kNothing)) return name + (hit ? "nothing is there to hit" : "the hit is missed");
    if (!hit) continue;
    const double off = std::abs(double{ray.from_scaled(hit->t)} - each.t) * std::sqrt(squared_length(each.direction));
    const double allowed = 0x1p-20 * (max_component(abs(each.origin)) + magnitude(bounds_of(each.triangle)));
    if (!(off <= allowed)) return absl::StrCat(name, "off by ", off, " of ", allowed);
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_EDGE_ON_CASES_H_
