// The line that shows the progress of long work: phase, bar, amount, rate and time left. Decides when and what to
// write; time is passed in as seconds of any clock that never goes back. Not thread-safe: ProgressWriter adds the lock,
// the clock and the thread.
#ifndef LOCUS_CORE_BASE_PROGRESS_LINE_H_
#define LOCUS_CORE_BASE_PROGRESS_LINE_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

namespace locus {

// kSilent: writes nothing. kLive: redraws one line of a terminal. kLines: writes a new line each time, for pipes and
// files.
enum class ProgressStyle : uint8_t { kSilent, kLive, kLines };

// Value of an option --progress.
enum class ProgressChoice : uint8_t { kAuto, kAlways, kNever };

// Returns the style for `choice`. `terminal` says whether the output is a terminal.
ProgressStyle progress_style(ProgressChoice choice, bool terminal);

// Unit of bytes; other units are words such as "rows".
inline constexpr char kProgressBytes[] = "bytes";

// A phase of long work.
struct ProgressPhase {
  std::string action = {};   // "uploading"
  std::string subject = {};  // "city"; may be empty
  std::string unit = {};     // kProgressBytes or a plural word; empty = the phase has no amount
  uint64_t total = 0;        // amount at the end of the phase; 0 = unknown
};

class ProgressLine {
 public:
  // Maximum number of seconds between two writes of a phase, and the minimum number between two writes of a live line
  // that update() causes.
  static constexpr double kRedrawSeconds = 0.5;
  static constexpr double kUpdateSeconds = 0.1;
  // Number of seconds between two lines of kLines.
  static constexpr double kLineSeconds = 1;

  // `columns` is the width of the terminal; a live line never reaches the last column, so that it never wraps.
  ProgressLine(ProgressStyle style, size_t columns) : style_(style), columns_(columns) {}

  // Each function returns the text to write now, which may be empty.
  // Begins a phase. A live line is drawn at once. A line of kLines is written at once if the action is new.
  std::string begin(ProgressPhase phase, double now);
  // Sets the amount that is done. `share` is the part of the phase that is done, from 0 to 1, if the total is unknown;
  // negative = unknown, too.
  std::string update(uint64_t done, double share, double now);
  // Sets the total of the phase.
  void set_total(uint64_t total) { phase_.total = total; }
  // Writes the line if it is due.
  std::string poll(double now);
  // Erases the live line until show() or the next phase.
  std::string hide();
  std::string show(double now);

  // Returns whether poll() can ever write: a phase has begun and the line is not hidden.
  bool active() const { return begun_ && !hidden_ && style_ != ProgressStyle::kSilent; }
  // Returns the time at which poll() writes next.
  double due() const { return written_ + (style_ == ProgressStyle::kLive ? kRedrawSeconds : kLineSeconds); }

 private:
  std::string draw(double now);
  std::string text(double now) const;
  double share() const;

  const ProgressStyle style_;
  const size_t columns_;
  ProgressPhase phase_;
  std::set<std::string> actions_;  // actions for which a line of kLines was written
  uint64_t done_ = 0;
  double share_ = -1;
  double started_ = 0;
  double written_ = 0;
  bool begun_ = false;
  bool hidden_ = false;
  bool visible_ = false;  // a live line is on the terminal
};

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PROGRESS_LINE_H_
