// Compounds: shapes made of up to limits::kMaxParts parts, which are balls, boxes and capsules with places in the axes
// of their object. A part of a placed compound is an ordinary Shape in world axes, and a pure function of the object's
// pose and of the part: its position is the object's position plus the part's position, rotated in double; its rotation
// is the product of both quaternions, normalised in double and rounded once. So all tests of shapes serve parts.
//
// Threads: a Compound is immutable; any thread. Objects that were inserted together share one Compound.
#ifndef LOCUS_CORE_GEOMETRY_COMPOUND_H_
#define LOCUS_CORE_GEOMETRY_COMPOUND_H_

#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/base/planted_bug.h"
#include "core/geometry/shape.h"

namespace locus {

// Part of a compound: a ball, box or capsule. Position and rotation are relative to the object's own axes; the other
// members are those of Shape. The part is in those layers that both the part and its object have.
struct Part {
  ShapeKind kind = ShapeKind::kBall;
  Vec3f position;
  Quaternion rotation;
  Vec3f size;
  float radius = 0;
  Layers layers = kAllLayers;

  friend constexpr bool operator==(const Part&, const Part&) = default;
};

class Compound;
using CompoundPtr = std::shared_ptr<const Compound>;

class Compound : public std::enable_shared_from_this<Compound> {
 public:
  // Makes a compound of 1 to limits::kMaxParts parts, none of which is a point or a compound.
  static CompoundPtr make(std::vector<Part> parts) { return std::make_shared<const Compound>(std::move(parts)); }
  explicit Compound(std::vector<Part> parts);

  const std::vector<Part>& parts() const { return parts_; }
  // Returns the extent of a part: an upper bound of the distance from the part's position to any of its points.
  double extent(size_t part) const { return extents_[part]; }
  // Returns an upper bound of the distance from the object's position to any point of any part. It does not depend on
  // the object's rotation.
  float extent() const { return extent_; }
  // Returns the bits that are in the layers of at least one part.
  Layers layers() const { return layers_; }
  size_t bytes() const { return sizeof(Compound) + parts_.size() * (sizeof(Part) + sizeof(double)); }

  friend bool operator==(const Compound& a, const Compound& b) { return a.parts_ == b.parts_; }

 private:
  std::vector<Part> parts_;
  std::vector<double> extents_;  // one for each part
  float extent_ = 0;
  Layers layers_ = 0;
};

// Returns the product of two unit quaternions, the rotation by `first` and then by `second`, normalised in double and
// rounded once.
Quaternion product(const Quaternion& second, const Quaternion& first);

// Compound in world axes. Borrows the compound.
class PlacedCompound {
 public:
  PlacedCompound(const Compound& compound, const Vec3d& position, const Quaternion& rotation)
      : compound_(compound), position_(position), quaternion_(rotation), rotation_(rotation_of(rotation)) {}

  // One part in world axes. Its shape is computed on demand, since most parts are culled by their loose bounds.
  class PlacedPart {
   public:
    PlacedPart(const PlacedCompound& whole, uint32_t number)
        : whole_(whole),
          number_(number),
          position_(whole.position_ + whole.rotation_.to_world(to_double(part().position))) {}

    uint32_t number() const { return number_; }
    const Part& part() const { return whole_.compound_.parts()[number_]; }
    // Returns a box that contains bounds_of(shape()), and is usually larger.
    Aabbd loose_bounds() const {
      constexpr double kBoundsGrowth = 0x1p-38;  // more than bounds_of() grows bounds
      const double extent = whole_.compound_.extent(number_);
      const double half = extent + kBoundsGrowth * (max_component(abs(position_)) + extent);
      return grown(Aabbd{position_, position_}, half);
    }
    Shape shape() const {
      const Part& one = part();
      const bool is_ball = one.kind == ShapeKind::kBall;
      return {one.kind, position_, is_ball ? Quaternion() : product(whole_.quaternion_, one.rotation), one.size,
              one.radius};
    }

   private:
    const PlacedCompound& whole_;
    const uint32_t number_;
    const Vec3d position_;
  };

  Shape shape(uint32_t part) const {
    LOCUS_DCHECK_LT(size_t{part}, compound_.parts().size());
    return PlacedPart(*this, part).shape();
  }
  // Calls fn(PlacedPart) for each part with a layer of `layers`, in order, until fn() returns false. Returns false if
  // it did.
  template <class Fn>
  bool for_each(Layers layers, const Fn& fn) const {
    const std::vector<Part>& parts = compound_.parts();
    for (uint32_t number = 0; number < parts.size(); ++number) {
      if ((parts[number].layers & layers) == 0 && !planted(PlantedBug::kPartMask)) continue;
      if (!fn(PlacedPart(*this, number))) return false;
    }
    return true;
  }
  // Returns the union of the bounds of all parts.
  Aabbd bounds() const;

 private:
  const Compound& compound_;
  const Vec3d position_;
  const Quaternion quaternion_;
  const Rotation rotation_;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_COMPOUND_H_
