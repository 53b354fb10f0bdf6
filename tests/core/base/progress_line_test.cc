#include "core/base/progress_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kErase[] = "\r\x1b[K";
const ProgressPhase kUpload = {.action = "uploading", .subject = "city", .unit = kProgressBytes, .total = 4 << 20};

TEST(ProgressLineTest, ALivePhaseShowsBarAmountRateAndTimeLeft) {
  ProgressLine line(ProgressStyle::kLive, 120);
  EXPECT_EQ(line.begin(kUpload, 10), std::string(kErase) +
                                         "uploading city  [....................]   0 %  0.0 of 4.0 "
                                         "MiB  0 s");
  EXPECT_EQ(
      line.update(1 << 20, -1, 12),
      std::string(kErase) + "uploading city  [#####...............]  25 %  1.0 of 4.0 MiB  512.0 KiB/s  6 s left");
}

TEST(ProgressLineTest, APhaseWithoutAmountShowsItsTime) {
  ProgressLine line(ProgressStyle::kLive, 120);
  EXPECT_EQ(line.begin({.action = "building", .subject = "the tree of city"}, 5),
            std::string(kErase) + "building the tree of city  0 s");
  EXPECT_EQ(line.poll(135), std::string(kErase) + "building the tree of city  2 min 10 s");
}

TEST(ProgressLineTest, RowsOfUnknownNumberHaveABarOnlyWithAShare) {
  ProgressLine line(ProgressStyle::kLive, 120);
  line.begin({.action = "sending", .subject = "stdin", .unit = "rows"}, 0);
  EXPECT_EQ(line.update(600, -1, 2), std::string(kErase) + "sending stdin  600 rows  300/s  2 s");
  EXPECT_EQ(line.update(900, 0.75, 3),
            std::string(kErase) + "sending stdin  [###############.....]  75 %  900 rows  300/s  1 s left");
}

// Runs the line as its writer does, with a clock that advances only here: it polls whenever the line is due.
TEST(ProgressLineTest, NoGapBetweenWritesIsAboveASecond) {
  for (const ProgressStyle style : {ProgressStyle::kLive, ProgressStyle::kLines}) {
    ProgressLine line(style, 80);
    double written = 100;
    ASSERT_NE(line.begin({.action = "building"}, written), "");
    for (int i = 0; i < 20; ++i) {
      const double due = line.due();
      EXPECT_LE(due - written, 1.0);
      EXPECT_EQ(line.poll(due - 0.01), "") << "not before it is due";
      ASSERT_NE(line.poll(due), "");
      written = due;
    }
  }
}

TEST(ProgressLineTest, UpdatesRedrawALiveLineAtMostTenTimesASecond) {
  ProgressLine line(ProgressStyle::kLive, 80);
  line.begin(kUpload, 0);
  int writes = 0;
  for (int i = 1; i <= 1000; ++i)
    if (!line.update(static_cast<uint64_t>(i), -1, i / 1000.0).empty()) ++writes;
  EXPECT_GE(writes, 9);
  EXPECT_LE(writes, 10);
}

TEST(ProgressLineTest, LinesAreWrittenOnceASecondAndForEveryNewAction) {
  ProgressLine line(ProgressStyle::kLines, 80);
  EXPECT_EQ(line.begin({.action = "uploading", .subject = "a"}, 0), "uploading a  0 s\n");
  EXPECT_EQ(line.begin({.action = "building", .subject = "a"}, 0.1), "building a  0 s\n");
  EXPECT_EQ(line.begin({.action = "uploading", .subject = "b"}, 0.2), "") << "the action is not new";
  EXPECT_EQ(line.poll(1.0), "");
  EXPECT_EQ(line.poll(1.2), "uploading b  1 s\n");
  EXPECT_EQ(line.hide(), "");
}

TEST(ProgressLineTest, AHiddenLineIsErasedAndStaysAway) {
  ProgressLine line(ProgressStyle::kLive, 80);
  EXPECT_EQ(line.hide(), "") << "nothing to erase";
  line.begin(kUpload, 0);
  EXPECT_EQ(line.hide(), kErase);
  EXPECT_EQ(line.hide(), "");
  EXPECT_EQ(line.update(1, -1, 50), "");
  EXPECT_EQ(line.poll(60), "");
  EXPECT_THAT(line.show(61), HasSubstr("uploading city"));
  EXPECT_EQ(line.hide(), kErase);
}

TEST(ProgressLineTest, TheLineNeverReachesTheLastColumn) {
  ProgressLine line(ProgressStyle::kLive, 12);
  EXPECT_EQ(line.begin({.action = "reading", .subject = "ööööööö"}, 0), std::string(kErase) + "reading ööö");
}

TEST(ProgressLineTest, ControlCharactersOfNamesAreReplaced) {
  ProgressLine line(ProgressStyle::kLines, 80);
  EXPECT_EQ(line.begin({.action = "reading", .subject = "a\x1b[2J\nb"}, 0), "reading a?[2J?b  0 s\n");
}

TEST(ProgressLineTest, ASilentLineWritesNothing) {
  ProgressLine line(ProgressStyle::kSilent, 80);
  EXPECT_EQ(line.begin(kUpload, 0), "");
  EXPECT_EQ(line.update(1, -1, 10), "");
  EXPECT_EQ(line.poll(20), "");
  EXPECT_EQ(line.hide(), "");
}

TEST(ProgressStyleTest, TheChoiceAndTheTerminalDecide) {
  EXPECT_EQ(progress_style(ProgressChoice::kAuto, true), ProgressStyle::kLive);
  EXPECT_EQ(progress_style(ProgressChoice::kAuto, false), ProgressStyle::kSilent);
  EXPECT_EQ(progress_style(ProgressChoice::kAlways, true), ProgressStyle::kLive);
  EXPECT_EQ(progress_style(ProgressChoice::kAlways, false), ProgressStyle::kLines);
  EXPECT_EQ(progress_style(ProgressChoice::kNever, true), ProgressStyle::kSilent);
}

}  // namespace
}  // namespace locus
