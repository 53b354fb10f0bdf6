#include "core/base/progress_line.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace locus {
namespace {

constexpr char kErase[] = "\r\x1b[K";
constexpr size_t kBarWidth = 20;
constexpr double kMinRateSeconds = 0.1;  // a rate over less time says nothing

// Unit for amounts of bytes of the size of `scale`.
struct ByteUnit {
  double size;
  const char* name;
};

ByteUnit byte_unit_of(double scale) {
  constexpr std::array<ByteUnit, 3> kUnits = {{{1 << 30, "GiB"}, {1 << 20, "MiB"}, {1 << 10, "KiB"}}};
  for (const ByteUnit& unit : kUnits)
    if (scale >= unit.size) return unit;
  return {1, "B"};
}

std::string bytes_text(double bytes) {
  const ByteUnit unit = byte_unit_of(bytes);
  return absl::StrFormat("%.*f %s", unit.size == 1 ? 0 : 1, bytes / unit.size, unit.name);
}

std::string amount_text(const ProgressPhase& phase, uint64_t done) {
  if (phase.unit != kProgressBytes) {
    return phase.total > 0 ? absl::StrCat(done, " of ", phase.total, " ", phase.unit)
                           : absl::StrCat(done, " ", phase.unit);
  }
  if (phase.total == 0) return bytes_text(static_cast<double>(done));
  const ByteUnit unit = byte_unit_of(static_cast<double>(phase.total));
  const int digits = unit.size == 1 ? 0 : 1;
  return absl::StrFormat("%.*f of %.*f %s", digits, static_cast<double>(done) / unit.size, digits,
                         static_cast<double>(phase.total) / unit.size, unit.name);
}

std::string rate_text(const ProgressPhase& phase, double rate) {
  if (phase.unit == kProgressBytes) return absl::StrCat(bytes_text(rate), "/s");
  return absl::StrFormat("%.*f/s", rate < 10 ? 1 : 0, rate);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<uint64_t>(std::clamp(seconds, 0.0, 1e9) + 0.5);
  if (whole < 100) return absl::StrCat(whole, " s");
  if (whole < 3600) return absl::StrCat(whole / 60, " min ", whole % 60, " s");
  return absl::StrCat(whole / 3600, " h ", whole / 60 % 60, " min");
}

std::string bar_text(double share) {
  const auto filled = static_cast<size_t>(share * static_cast<double>(kBarWidth));
  return absl::StrCat("[", std::string(filled, '#'), std::string(kBarWidth - filled, '.'), "]");
}

// Returns `text` with control characters replaced, since names come from users and servers.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

// Returns the beginning of `text` (UTF-8) that has at most `characters` characters.
std::string shortened(std::string text, size_t characters) {
  size_t count = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool starts_character = (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80;
    if (starts_character && count++ == characters) {
      text.resize(i);
      break;
    }
  }
  return text;
}

}  // namespace

ProgressStyle progress_style(ProgressChoice choice, bool terminal) {
  if (choice == ProgressChoice::kNever) return ProgressStyle::kSilent;
  if (terminal) return ProgressStyle::kLive;
  return choice == ProgressChoice::kAlways ? ProgressStyle::kLines : ProgressStyle::kSilent;
}

std::string ProgressLine::begin(ProgressPhase phase, double now) {
  const bool new_action = actions_.insert(phase.action).second;
  phase_ = std::move(phase);
  done_ = 0;
  share_ = -1;
  started_ = now;
  hidden_ = false;
  const bool first = !std::exchange(begun_, true);
  if (style_ == ProgressStyle::kLive || first || new_action) return draw(now);
  return poll(now);
}

std::string ProgressLine::update(uint64_t done, double share, double now) {
  done_ = done;
  share_ = share;
  if (style_ == ProgressStyle::kLive && active() && now - written_ >= kUpdateSeconds) return draw(now);
  return poll(now);
}

std::string ProgressLine::poll(double now) { return active() && now >= due() ? draw(now) : ""; }

std::string ProgressLine::hide() {
  hidden_ = true;
  return std::exchange(visible_, false) ? kErase : "";
}

std::string ProgressLine::show(double now) {
  hidden_ = false;
  if (style_ == ProgressStyle::kLive && active()) return draw(now);
  return poll(now);
}

std::string ProgressLine::draw(double now) {
  if (style_ == ProgressStyle::kSilent) return "";
  written_ = now;
  if (style_ == ProgressStyle::kLines) return absl::StrCat(text(now), "\n");
  visible_ = true;
  return absl::StrCat(kErase, shortened(text(now), columns_ > 1 ? columns_ - 1 : 1));
}

double ProgressLine::share() const {
  if (phase_.total == 0) return std::min(share_, 1.0);
  return std::min(1.0, static_cast<double>(done_) / static_cast<double>(phase_.total));
}

std::string ProgressLine::text(double now) const {
  const double seconds = std::max(0.0, now - started_);
  std::string text = phase_.action;
  if (!phase_.subject.empty()) absl::StrAppend(&text, " ", phase_.subject);
  text = printable(std::move(text));
  if (phase_.unit.empty()) return absl::StrCat(text, "  ", duration_text(seconds));
  const double part = share();
  if (part >= 0) absl::StrAppendFormat(&text, "  %s %3.0f %%", bar_text(part), 100 * part);
  absl::StrAppend(&text, "  ", amount_text(phase_, done_));
  if (seconds >= kMinRateSeconds) absl::StrAppend(&text, "  ", rate_text(phase_, static_cast<double>(done_) / seconds));
  if (part > 0 && seconds >= kMinRateSeconds) {
    absl::StrAppend(&text, "  ", duration_text(seconds * (1 - part) / part), " left");
  } else {
    absl::StrAppend(&text, "  ", duration_text(seconds));
  }
  return text;
}

}  // namespace locus
