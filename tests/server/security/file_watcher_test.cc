#include "server/security/file_watcher.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>

#include "core/base/mutex.h"
#include "server/security/text_file.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

FileMark mark(uint64_t inode, uint64_t bytes = 1, int64_t modified = 1) {
  FileMark made;
  made.inode = inode;
  made.bytes = bytes;
  made.modified_ns = modified;
  return made;
}

class FileChangesTest : public testing::Test {
 protected:
  FileChanges changes() {
    return FileChanges({"a", "b"}, [this](const std::string& file) { return marks_[file]; });
  }

  std::map<std::string, FileMark> marks_ = {{"a", mark(1)}, {"b", mark(2)}};
};

TEST_F(FileChangesTest, NothingIsReportedWithoutAChange) {
  FileChanges changes = this->changes();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(changes.look());
}

TEST_F(FileChangesTest, AChangeIsReportedOnceWhenItIsStable) {
  FileChanges changes = this->changes();
  for (const FileMark& changed : {mark(9), mark(1, 2), mark(1, 2, 3), mark(1)}) {
    marks_["a"] = changed;
    EXPECT_FALSE(changes.look());
    EXPECT_TRUE(changes.look());
    EXPECT_FALSE(changes.look());
  }
}

TEST_F(FileChangesTest, AFileThatIsStillWrittenIsNotReported) {
  FileChanges changes = this->changes();
  for (uint64_t bytes = 2; bytes < 20; ++bytes) {
    marks_["b"] = mark(2, bytes, static_cast<int64_t>(bytes));
    EXPECT_FALSE(changes.look()) << bytes;
  }
  EXPECT_TRUE(changes.look());
}

TEST_F(FileChangesTest, AChangeThatIsUndoneBeforeItIsStableIsNone) {
  FileChanges changes = this->changes();
  marks_["a"] = mark(9);
  EXPECT_FALSE(changes.look());
  marks_["a"] = mark(1);
  EXPECT_FALSE(changes.look());
  EXPECT_FALSE(changes.look());
}

TEST_F(FileChangesTest, AbsenceAndReturnAreChanges) {
  FileChanges changes = this->changes();
  for (const FileMark& next : {FileMark(), mark(5)}) {
    marks_["a"] = next;
    EXPECT_FALSE(changes.look());
    EXPECT_TRUE(changes.look());
  }
}

TEST(FileMarkTest, ReplacingWritingAndRemovingAFileChangeItsMark) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("f");
  EXPECT_EQ(mark_of(file), FileMark());
  ASSERT_TRUE(replace_text_file(file, "a", 0600).ok());
  const FileMark first = mark_of(file);
  EXPECT_NE(first, FileMark());
  EXPECT_EQ(mark_of(file), first);
  ASSERT_TRUE(replace_text_file(file, "a", 0600).ok());
  const FileMark second = mark_of(file);
  EXPECT_NE(second, first);
  std::ofstream(file, std::ios::app) << "b";
  EXPECT_NE(mark_of(file), second);
  const std::string link = folder.file("link");
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(mark_of(link), mark_of(file));  // a link is followed
}

// Counts calls and waits for them.
class CallCount {
 public:
  void add() {
    MutexLock lock(mutex_);
    ++count_;
    changed_.notify_all();
  }
  // Waits until at least `count` calls were made, for at most 20 s. Returns whether they were made.
  bool reaches(int count) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    MutexLock lock(mutex_);
    while (count_ < count)
      if (!changed_.wait_until(mutex_, deadline)) return count_ >= count;
    return true;
  }

 private:
  Mutex mutex_;
  ConditionVariable changed_;
  int count_ LOCUS_GUARDED_BY(mutex_) = 0;
};

TEST(FileWatcherTest, EachReplacementIsNoticed) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("f");
  CallCount calls;
  const FileWatcher watcher(
      {file},
      [&] {
        calls.add();
        return true;
      },
      std::chrono::milliseconds(1));
  EXPECT_TRUE(calls.reaches(1));  // the files are read immediately
  for (int i = 2; i <= 6; ++i) {
    ASSERT_TRUE(replace_text_file(file, "a", 0600).ok());
    EXPECT_TRUE(calls.reaches(i)) << i;
  }
  std::filesystem::remove(file);
  EXPECT_TRUE(calls.reaches(7));
}

TEST(FileWatcherTest, AFailedReadingIsRepeatedUntilItSucceeds) {
  CallCount calls;
  std::atomic<int> failures{3};
  const FileWatcher watcher(
      {"/nonexistent"},
      [&] {
        calls.add();
        return failures.fetch_sub(1) <= 0;
      },
      std::chrono::milliseconds(1), std::chrono::milliseconds(1));
  EXPECT_TRUE(calls.reaches(4));
  EXPECT_LE(failures.load(), 0);
}

TEST(FileWatcherTest, AWatcherEndsWithoutWaitingForItsPause) {
  const FileWatcher watcher(
      {"/nonexistent"}, [] { return false; }, std::chrono::hours(1));  // a destructor that waits would time out
}

}  // namespace
}  // namespace locus::server
