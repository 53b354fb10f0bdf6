// Choice of a cell size from measured figures, for `locus tune`. Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_CHOICE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_CHOICE_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/types/span.h"

namespace locus::cli {

// Gain below which a cell size is not worth a change, and the loss that is accepted for letting the server choose.
inline constexpr double kMinGainPercent = 10, kChosenAllowance = 0.05;
// Exponents of cell sizes: the smallest and the largest that a server accepts, and the largest distance of the search
// from the present size.
inline constexpr int kMinExponent = -20, kMaxExponent = 31, kSearchReach = 12;

// Mean cost of a query of one kind.
struct KindCost {
  double nanoseconds = 0;
  double work = 0;
};

// Figures of one cell size, measured in turns with those of the present one.
struct SizeFigures {
  double setting = 0;       // SceneSpec.cell_size: a power of two, or 0: the server chooses
  double cell_size = 0;     // the size that applies
  bool is_present = false;  // whether the scene has cells of this size now
  double build_ms = 0;
  uint64_t bytes = 0;
  std::map<std::string, KindCost> kinds;
  double relative = 1;       // time of all queries, relative to the present cell size
  bool is_confirmed = true;  // whether the time is one of a second measurement, so that it is not the luck of the best
};

// Weight of one query by kind: the number of queries if the user gave them, so that their mix counts. Otherwise the
// inverse of the present cost, so that each kind counts alike.
using KindWeights = std::map<std::string, double>;

// Returns the weighted sum of the nanoseconds of all kinds.
double weighted_time(const std::map<std::string, KindCost>& kinds, const KindWeights& weights);

// Returns the weights by which each kind of `present` has the same weighted time.
KindWeights equal_weights(const std::map<std::string, KindCost>& present);

// Returns the exponents of the cell sizes to measure next, ascending. `times` has the relative time of each exponent
// that was measured; none at first. The search measures every second exponent around `present`, then the neighbours of
// the best, and continues in its direction while the best is the smallest or the largest. Returns none at the end.
std::vector<int> next_exponents(const std::map<int, double>& times, int present);

// The cell size that tune names.
struct SizeChoice {
  size_t index = 0;         // of the figures
  double cell_size = 0;     // value for SceneSpec.cell_size
  double gain_percent = 0;  // time that the queries save; negative if they take longer
  bool leave_it = true;     // whether the gain is too small for a change
};

// Returns the choice among the confirmed figures, which contain those of the present cell size. Prefers the size that
// the server chooses to one that is better by up to kChosenAllowance, because the server adapts it, unless only the
// other one is worth a change. `setting` is the scene's SceneSpec.cell_size: if it is 0, the server would not choose
// anew, so a size that it chooses now is named as a fixed size. Precondition: a figure is confirmed.
SizeChoice choose_size(absl::Span<const SizeFigures> figures, double setting);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_CELL_CHOICE_H_
