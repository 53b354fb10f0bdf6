// Small value types that UpdateBuilder and QueryBuilder accept for one row: points, rotations and labels; and Revision,
// which identifies a state of a scene. For callers of the library. Plain data; the server checks the values.
#ifndef LOCUS_CLIENT_LIB_VALUES_H_
#define LOCUS_CLIENT_LIB_VALUES_H_

#include <cstdint>
#include <optional>

namespace locus::client {

// Position relative to the frame of a batch or block.
struct Float3 {
  float x = 0, y = 0, z = 0;
};

// Absolute position of an object, or of the frame of a batch or block.
struct Double3 {
  double x = 0, y = 0, z = 0;
};

// Position of an object: a Float3 is relative to the batch's frame, a Double3 is absolute.
struct Position {
  Position(const Float3& relative) : value{relative.x, relative.y, relative.z} {}  // NOLINT: implicit on purpose
  Position(const Double3& world) : value(world), absolute(true) {}                 // NOLINT: implicit on purpose

  Double3 value;  // a relative position is converted without rounding
  bool absolute = false;
};

// Unit quaternion; the server refuses a quaternion whose length differs from 1 by more than 1e-3.
struct Rotation {
  float x = 0, y = 0, z = 0, w = 1;

  friend constexpr bool operator==(const Rotation&, const Rotation&) = default;
};

// Labels by which queries filter and report a new object, and its lifetime. The defaults equal the protocol's defaults.
struct Labels {
  // A query finds the object iff (layers & mask of the query) != 0; 0 = hidden. None = bit 0 (the value 1) or, for a
  // compound whose parts have layers, all layers of the parts.
  std::optional<uint32_t> layers = std::nullopt;
  uint64_t group = 0;  // 0 = no group
  uint64_t tag = 0;
  uint64_t expire_ticks = 0;  // number of ticks that the object exists, at most 2^48; 0 = until it is removed
};

// Identifier of one state of a scene. Revisions are counted within an epoch; a scene that was restarted without its
// state begins another epoch.
struct Revision {
  uint64_t epoch = 0;
  uint64_t revision = 0;

  friend constexpr bool operator==(const Revision&, const Revision&) = default;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_VALUES_H_
