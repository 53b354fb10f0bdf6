// Known bugs that tests can plant to prove that the suite would catch them. Outside the library built for those tests
// (LOCUS_PLANT_BUGS) planted() is constant false and costs nothing.
#ifndef LOCUS_CORE_BASE_PLANTED_BUG_H_
#define LOCUS_CORE_BASE_PLANTED_BUG_H_

namespace locus {

enum class PlantedBug {
  kNone,
  kDropCell,           // the grid forgets one occupied cell of a query's range
  kStrictTie,          // < for <= where a touching or equal hit decides
  kStaleSnapshot,      // a published snapshot keeps the objects of the revision before
  kGhostAfterMove,     // a move across a cell border leaves the object in its old cell
  kUnsignedCellIndex,  // cell indices truncate towards zero instead of flooring
  kUnpaddedNear,       // the near side of the slab test of tree nodes goes without its pad
};

#ifdef LOCUS_PLANT_BUGS
inline PlantedBug planted_bug = PlantedBug::kNone;
inline bool planted(PlantedBug bug) { return planted_bug == bug; }
#else
constexpr bool planted(PlantedBug) { return false; }
#endif

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PLANTED_BUG_H_
