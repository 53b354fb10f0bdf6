// Cases country/ball, country/box, country/ray, country/nearest and country/memory: queries in the open country of a
// world with a hub, in which half of the objects are crowded. The queries are balls and boxes of kCountryReach, rays of
// kRayLength, and the kNearestCount nearest objects, all so far from the hub that they find only objects outside it.
// The peer `uniform` is a scene that contains only the objects outside the hub, so both scenes find equal rows; in the
// case `memory`, it is a uniform world of as many objects. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_COUNTRY_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_COUNTRY_CASES_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

inline constexpr float kCountryReach = 50;

void run_country_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_COUNTRY_CASES_H_
