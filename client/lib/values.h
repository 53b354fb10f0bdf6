// Small plain values that builders take by row: points, rotations, labels, revisions. For callers of the library; no
// threads, no invariants beyond what a comment says.
#ifndef LOCUS_CLIENT_LIB_VALUES_H_
#define LOCUS_CLIENT_LIB_VALUES_H_

#include <cstdint>

namespace locus::client {

// Relative to a batch's or block's frame.
struct Float3 {
  float x = 0, y = 0, z = 0;
};

// Absolute, or a frame itself.
struct Double3 {
  double x = 0, y = 0, z = 0;
};

// Where an object goes: a Float3 is relative to the batch's frame, a Double3 absolute.
struct Position {
  Position(const Float3& relative) : value{relative.x, relative.y, relative.z} {}  // NOLINT: meant to convert
  Position(const Double3& there) : value(there), absolute(true) {}                 // NOLINT: meant to convert

  Double3 value;  // exact for both
  bool absolute = false;
};

// A unit quaternion; the server refuses one that is off unit length by more than 1e-3.
struct Rotation {
  float x = 0, y = 0, z = 0, w = 1;

  friend constexpr bool operator==(const Rotation&, const Rotation&) = default;
};

// By what queries choose and report a thing. The defaults are the protocol's.
struct Labels {
  uint32_t layers = 1;  // found iff (layers & mask) != 0; 0 = hidden
  uint64_t group = 0;   // 0 = none
  uint64_t tag = 0;
};

// A moment of a scene. Revisions count within an epoch; a scene that started over has another epoch.
struct Revision {
  uint64_t epoch = 0;
  uint64_t revision = 0;

  friend constexpr bool operator==(const Revision&, const Revision&) = default;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_VALUES_H_
