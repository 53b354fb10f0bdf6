#include "tests/bench/structures/structures_suite.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check.h"
#include "tests/bench/frame/heap.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/structures/structure.h"

namespace locus::bench::structures {
namespace {

constexpr uint32_t kLargestList = 100'000;  // above this count, the peer is the bvh
constexpr uint32_t kFewestForExponent = 1000;

std::string count_name(uint32_t count) {
  const int power = static_cast<int>(std::lround(std::log10(count)));
  return std::lround(std::pow(10, power)) == count ? absl::StrCat("1e", power) : absl::StrCat(count);
}

// Returns how often the queries are repeated, so that the clock's resolution does not matter.
size_t passes_of(const std::string& structure, uint32_t count) {
  return structure == "list" ? std::clamp<size_t>(kLargestList / count, 1, 20) : 20;
}

// Values of one structure for one query of one scene, by count.
struct Series {
  std::vector<double> counts, values;
};

class SuiteRun {
 public:
  SuiteRun(const Options& options, const Progress& progress, Report& report)
      : options_(options), progress_(progress), report_(report), structures_(structures()) {}

  void run() {
    for (const SceneKind kind : kScenes) {
      for (const uint32_t count : counts_of(kind)) run_scene(kind, count);
      add_exponents(kind);
      note_crossings();
    }
  }

 private:
  struct Held {
    std::string name;
    std::unique_ptr<Structure> structure;
    double bytes = 0;
    double build_seconds = 0;
  };

  std::vector<uint32_t> counts_of(SceneKind kind) const {
    if (options_.quick)
      return kind == SceneKind::kUniform ? std::vector<uint32_t>{1000, 10'000} : std::vector<uint32_t>{1000};
    if (kind != SceneKind::kUniform) return {1000, 10'000, 100'000};
    return {10, 30, 100, 300, 1000, 10'000, 100'000, 1'000'000};
  }

  std::string case_name(const std::string& what, const std::string& structure) const {
    return absl::StrCat(what, "/", structure, "/", scene_, "/", count_name(count_));
  }

  // Returns whether any case of the scene is wanted.
  bool wanted() const {
    if (options_.filter.wants_every()) return true;
    for (const NamedStructure& named : structures_) {
      for (const QueryName query : kQueryNames) {
        for (const char* prefix : {"", "work/"}) {
          if (options_.filter.wants(case_name(absl::StrCat(prefix, name_of(query)), named.name))) return true;
        }
        if (options_.filter.wants(exponent_name(query, named.name))) return true;
      }
      for (const char* what : {"build", "insert", "remove", "memory"}) {
        if (options_.filter.wants(case_name(what, named.name))) return true;
      }
    }
    return false;
  }

  std::string exponent_name(QueryName query, const std::string& structure) const {
    return absl::StrCat("exponent/", name_of(query), "/", structure, "/", scene_);
  }

  void run_scene(SceneKind kind, uint32_t count) {
    scene_ = name_of(kind);
    count_ = count;
    if (!wanted()) return;
    progress_(absl::StrCat(scene_, "/", count_name(count)));
    const Scene scene = scene_of(kind, count);
    const SceneQueries queries = queries_of(scene, options_.quick ? 50 : 200);
    std::vector<Held> held;
    for (const NamedStructure& named : structures_) {
      if (named.name == "list" && count > kLargestList) continue;
      Held& one = held.emplace_back(Held{named.name, named.make()});
      const int64_t before = heap_bytes();
      const double start = thread_seconds();
      one.structure->build(scene.boxes);
      one.build_seconds = thread_seconds() - start;
      one.bytes = static_cast<double>(heap_bytes() - before);
    }
    add_builds(held, static_cast<double>(count));
    for (const QueryName query : kQueryNames) run_query(query, queries, held);
    run_changes(scene, held);
  }

  void add(const std::string& what, const Held& ours, const Held& peer, double our_value, double peer_value,
           const std::string& metric, const std::string& hash) {
    Cell cell{.suite = "structures",
              .case_name = case_name(what, ours.name),
              .metric = metric,
              .ours = our_value,
              .peer = peer_value,
              .peer_name = peer.name,
              .ratio = peer_value / our_value,
              .spread = 0,
              .results_hash = hash};
    if (options_.filter.wants(cell.case_name)) report_.add(std::move(cell));
  }

  void add_builds(const std::vector<Held>& held, double count) {
    for (size_t i = 1; i < held.size(); ++i) {
      const std::string hash = hash_of_number(static_cast<uint64_t>(count));
      add("build", held[i], held[0], held[i].build_seconds * 1e9 / count, held[0].build_seconds * 1e9 / count,
          "ns/value", hash);
      add("memory", held[i], held[0], held[i].bytes / count, held[0].bytes / count, "bytes/value", hash);
      series_[absl::StrCat("memory/", held[i].name)].counts.push_back(count);
      series_[absl::StrCat("memory/", held[i].name)].values.push_back(held[i].bytes);
    }
  }

  void run_query(QueryName query, const SceneQueries& queries, const std::vector<Held>& held) {
    const size_t count = queries.points.size();
    std::vector<Work> work(held.size());
    std::vector<uint64_t> hashes(held.size(), 0);
    std::vector<Contestant> contestants;
    for (size_t i = 0; i < held.size(); ++i) {
      const Structure& structure = *held[i].structure;
      for (size_t n = 0; n < count; ++n) hashes[i] = hashes[i] * 31 + structure.answer(query, queries, n, work[i]);
      if (hashes[i] != hashes[0])
        report_.disagreements.push_back(
            absl::StrCat(case_name(name_of(query), held[i].name), " differs from ", held[0].name));
      const size_t passes = passes_of(held[i].name, count_);
      contestants.push_back({held[i].name,
                             [&structure, &queries, query, count, passes](size_t) {
                               Work ignored;
                               uint64_t sum = 0;
                               for (size_t n = 0; n < count * passes; ++n)
                                 sum += structure.answer(query, queries, n % count, ignored);
                               LOCUS_CHECK(sum != 0);
                             },
                             static_cast<double>(count * passes),
                             {}});
    }
    const std::string hash = hash_of_number(hashes[0]);
    for (size_t i = 0; i < held.size(); ++i) {
      const double units =
          static_cast<double>(work[i].nodes + work[i].cells + work[i].tests) / static_cast<double>(count);
      const double peer =
          static_cast<double>(work[0].nodes + work[0].cells + work[0].tests) / static_cast<double>(count);
      if (i > 0) add(absl::StrCat("work/", name_of(query)), held[i], held[0], units, peer, "steps/query", hash);
      Series& series = series_[absl::StrCat(name_of(query), "/", held[i].name)];
      series.counts.push_back(count_);
      series.values.push_back(units);
    }
    if (std::none_of(held.begin() + 1, held.end(),
                     [&](const Held& one) { return options_.filter.wants(case_name(name_of(query), one.name)); }))
      return;
    const auto times = race(contestants, 1, options_.rounds, thread_seconds, WarmUp::kDone);
    if (held[0].name == "list") {
      for (size_t i = 1; i < held.size(); ++i) {
        Series& series = ratios_[absl::StrCat(name_of(query), "/", held[i].name)];
        series.counts.push_back(count_);
        series.values.push_back(median(round_ratios(times[i], times[0])));
      }
    }
    for (size_t i = 1; i < held.size(); ++i) {
      const std::vector<double> ratios = round_ratios(times[i], times[0]);
      Cell cell{.suite = "structures",
                .case_name = case_name(name_of(query), held[i].name),
                .metric = "ns/query",
                .ours = median(times[i]),
                .peer = median(times[0]),
                .peer_name = held[0].name,
                .ratio = median(ratios),
                .spread = spread(ratios),
                .results_hash = hash};
      if (options_.filter.wants(cell.case_name)) report_.add(std::move(cell));
    }
  }

  // Times the removal and the insertion of a few boxes.
  void run_changes(const Scene& scene, const std::vector<Held>& held) {
    const size_t changed = std::min<size_t>(scene.boxes.size() / 10, 1000);
    std::vector<std::pair<double, double>> nanoseconds;
    for (const Held& one : held) {
      if (!one.structure->changes()) {
        nanoseconds.emplace_back(0, 0);
        continue;
      }
      const double start = thread_seconds();
      for (size_t i = 0; i < changed; ++i) one.structure->remove(scene.boxes[i]);
      const double middle = thread_seconds();
      for (size_t i = 0; i < changed; ++i) one.structure->insert(scene.boxes[i]);
      const double scale = 1e9 / static_cast<double>(changed);
      nanoseconds.emplace_back((middle - start) * scale, (thread_seconds() - middle) * scale);
    }
    const size_t peer = 0;
    if (!held[peer].structure->changes()) return;  // without a list there is nothing to compare with
    for (size_t i = 1; i < held.size(); ++i) {
      if (!held[i].structure->changes()) continue;
      const std::string hash = hash_of_number(changed);
      add("remove", held[i], held[peer], nanoseconds[i].first, nanoseconds[peer].first, "ns/value", hash);
      add("insert", held[i], held[peer], nanoseconds[i].second, nanoseconds[peer].second, "ns/value", hash);
    }
  }

  // Adds the exponent of the work of each query, and of the bytes, for counts from kFewestForExponent on. The peer's
  // exponent is the list's. The ratio says how many times less the work of the structure grows when there are ten times
  // as many values.
  void add_exponents(SceneKind kind) {
    scene_ = name_of(kind);
    for (auto& [name, series] : series_) {
      while (!series.counts.empty() && series.counts.front() < kFewestForExponent) {
        series.counts.erase(series.counts.begin());
        series.values.erase(series.values.begin());
      }
    }
    for (const auto& [name, series] : series_) {
      const std::string full = absl::StrCat("exponent/", name, "/", scene_);
      const bool is_list = name.ends_with("/list");
      if (series.counts.size() < 2 || !options_.filter.wants(full)) continue;
      const double ours = exponent_of(series.counts, series.values);
      const auto peer = series_.find(absl::StrCat(name.substr(0, name.find('/')), "/list"));
      const double theirs =
          peer == series_.end() || is_list ? 1 : exponent_of(peer->second.counts, peer->second.values);
      report_.add({.suite = "structures",
                   .case_name = full,
                   .metric = "exponent",
                   .ours = ours,
                   .peer = theirs,
                   .peer_name = is_list || peer == series_.end() ? "linear" : "list",
                   .ratio = std::pow(10, theirs - ours),
                   .spread = 0,
                   .results_hash = hash_of_number(series.counts.size())});
    }
    series_.clear();
  }

  // Notes for how many boxes a structure and the list take the same time, for each query that was timed.
  void note_crossings() {
    for (const auto& [name, series] : ratios_) {
      const double count = crossing_of(series.counts, series.values);
      if (count > 0)
        report_.notes.push_back(
            absl::StrFormat("%s and the list take the same time at %.0f boxes of %s", name, count, scene_));
    }
    ratios_.clear();
  }

  const Options& options_;
  const Progress& progress_;
  Report& report_;
  const std::vector<NamedStructure> structures_;
  std::string scene_;
  uint32_t count_ = 0;
  std::map<std::string, Series> series_;  // by QUERY/STRUCTURE
  std::map<std::string, Series> ratios_;  // by QUERY/STRUCTURE: the list's time divided by the structure's
};

}  // namespace

double exponent_of(const std::vector<double>& counts, const std::vector<double>& values) {
  LOCUS_CHECK_EQ(counts.size(), values.size());
  double mean_x = 0, mean_y = 0;
  const double n = static_cast<double>(counts.size());
  for (size_t i = 0; i < counts.size(); ++i) {
    mean_x += std::log(counts[i]) / n;
    mean_y += std::log(values[i]) / n;
  }
  double products = 0, squares = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    const double x = std::log(counts[i]) - mean_x;
    products += x * (std::log(values[i]) - mean_y);
    squares += x * x;
  }
  LOCUS_CHECK(squares > 0);
  return products / squares;
}

double crossing_of(const std::vector<double>& counts, const std::vector<double>& ratios) {
  LOCUS_CHECK_EQ(counts.size(), ratios.size());
  for (size_t i = counts.size(); i-- > 1;) {
    if (ratios[i] < 1 || ratios[i - 1] >= 1) continue;
    const double share = std::log(1 / ratios[i - 1]) / std::log(ratios[i] / ratios[i - 1]);
    return counts[i - 1] * std::pow(counts[i] / counts[i - 1], share);
  }
  return 0;
}

absl::Status run_structures_suite(const Options& options, const Progress& progress, Report& report) {
  SuiteRun(options, progress, report).run();
  return absl::OkStatus();
}

}  // namespace locus::bench::structures
