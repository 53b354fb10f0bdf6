#include "client/cli/rows/past_options.h"

#include <algorithm>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"

namespace locus::cli {

std::istream& operator>>(std::istream& in, AsOf& time) {
  std::string text;
  in >> text;
  const size_t plus = text.find('+');
  const bool no_fraction = plus == std::string::npos;
  if (!absl::SimpleAtoi(text.substr(0, plus), &time.tick) ||
      (!no_fraction && !absl::SimpleAtof(text.substr(plus + 1), &time.fraction)))
    in.setstate(std::ios::failbit);
  return in;
}

std::ostream& operator<<(std::ostream& out, const AsOf& time) {
  out << time.tick;
  return time.fraction == 0 ? out : out << '+' << time.fraction;
}

void add_past_options(CLI::App& command, PastOptions& options) {
  add_repeatable(command, "--as-of", options.as_of, "TICK[+FRACTION]",
                 "Query objects as of the end of a tick, or a fraction later; one for each query, or one for all");
  const NamedValues<v1::OutsideHistory> outsides = {{"reject", v1::OUTSIDE_HISTORY_REJECT},
                                                    {"clamp", v1::OUTSIDE_HISTORY_CLAMP}};
  command
      .add_option("--outside", options.outside, "Times outside the history: reject, clamp (use the nearest) [reject]")
      ->type_name("WHAT")
      ->transform(choices(outsides));
}

std::vector<uint64_t> ticks_of(const std::vector<AsOf>& times) {
  std::vector<uint64_t> ticks;
  ticks.reserve(times.size());
  for (const AsOf& time : times) ticks.push_back(time.tick);
  return ticks;
}

std::vector<float> fractions_of(const std::vector<AsOf>& times) {
  std::vector<float> fractions;
  if (std::all_of(times.begin(), times.end(), [](const AsOf& time) { return time.fraction == 0; })) return fractions;
  fractions.reserve(times.size());
  for (const AsOf& time : times) fractions.push_back(time.fraction);
  return fractions;
}

bool rows_have_time(const PastOptions& options, Format format) {
  return !options.as_of.empty() && (format == Format::kCsv || format == Format::kNdjson);
}

Json resolved_json(const v1::BlockResult& block) {
  Json times = Json::array();
  for (int i = 0; i < block.resolved_ticks_size(); ++i) {
    std::string time = absl::StrCat(block.resolved_ticks(i));
    const float fraction = i < block.resolved_fractions_size() ? block.resolved_fractions(i) : 0;
    if (fraction != 0) absl::StrAppend(&time, "+", fraction);
    times.push_back(std::move(time));
  }
  return times;
}

}  // namespace locus::cli
