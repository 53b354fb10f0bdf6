// The machine's file system with injected disk faults: it tracks which data is synced, so that a test can get the state
// after a power loss, and returns errors on request. It never syncs files itself, which makes tests fast. A power loss
// preserves for each file the bytes written before the file's last sync, and for each folder the entries at the
// folder's last sync. So a removed or replaced file exists again if its folder was not synced after the change.
//
// Threads: may be used from any thread, as RocksDB does.
#ifndef LOCUS_TESTS_SUPPORT_FAULTY_FILES_H_
#define LOCUS_TESTS_SUPPORT_FAULTY_FILES_H_

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "core/base/check.h"
#include "rocksdb/env.h"
#include "rocksdb/file_system.h"
#include "tests/support/random.h"

namespace locus::test {

inline std::string file_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void write_file_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  LOCUS_CHECK(out.good());
}

// Flips a bit of `text` in the only file below `folder` that contains `text`.
inline void flip_bit_of(const std::string& text, const std::string& folder) {
  size_t found = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::string bytes = file_bytes(entry.path().string());
    const size_t at = bytes.find(text);
    if (at == std::string::npos) continue;
    ++found;
    bytes[at] = static_cast<char>(bytes[at] ^ 1);
    write_file_bytes(entry.path().string(), bytes);
  }
  EXPECT_EQ(found, 1u);
}

class FaultyFiles final : public rocksdb::FileSystemWrapper {
 public:
  using Status = rocksdb::IOStatus;

  // Tracks all files below the existing folder `root`. `graveyard` is a folder to which removed files are moved.
  FaultyFiles(std::string root, std::string graveyard)
      : FileSystemWrapper(rocksdb::FileSystem::Default()), root_(std::move(root)), graveyard_(std::move(graveyard)) {
    std::filesystem::create_directories(graveyard_);
  }
  const char* Name() const override { return "FaultyFiles"; }

  // Simulates a power loss: the next `change` changes take effect, all changes after them fail.
  void stop_before(uint64_t change) { changes_left_ = change; }
  // Ends the simulated power loss as if only the process had restarted: all written data remains, synced or not.
  void go_on() { changes_left_ = kForEver; }
  bool stopped() const { return changes_left_ == 0; }
  uint64_t changes() const { return changes_; }
  // These functions make the next `count` syncs or writes of RocksDB's log files (*.log) fail. Other files are
  // excluded, since their concurrent writes would consume faults at random. If `count` is negative, all syncs or writes
  // of all files fail.
  void fail_syncs(int64_t count) { failing_syncs_ = count; }
  void fail_writes(int64_t count) { failing_writes_ = count; }
  // Returns the number of writes that will fail.
  int64_t writes_to_fail() const { return failing_writes_; }
  // If `full` is true, makes every write fail because the disk is full, and GetFreeSpace() return 0, until fill(false).
  void fill(bool full) { full_ = full; }

  // Writes the files that remain after a power loss into the folder `to`. If `torn` is true, a file may also keep some
  // of its unsynced bytes, from the first one on.
  void lose_power(const std::string& to, Random& random, bool torn) {
    const std::lock_guard lock(mutex_);
    std::filesystem::create_directories(to);
    for (const auto& [path, file] : durable_) {
      LOCUS_CHECK(path.starts_with(root_));
      std::string bytes = file->held ? *file->held : file_bytes(file->place);
      if (!file->held) {
        size_t kept = std::min<size_t>(file->synced, bytes.size());
        if (torn && bytes.size() > kept) kept += random.below(bytes.size() - kept + 1);
        bytes.resize(kept);
      }
      const std::string copy = to + path.substr(root_.size());
      std::filesystem::create_directories(std::filesystem::path(copy).parent_path());
      write_file_bytes(copy, bytes);
    }
  }

  Status NewWritableFile(const std::string& path, const rocksdb::FileOptions& options,
                         std::unique_ptr<rocksdb::FSWritableFile>* result, rocksdb::IODebugContext* debug) override {
    if (Status status = change(); !status.ok()) return status;
    bury(path);
    return opened(target()->NewWritableFile(path, options, result, debug), path, true, result);
  }
  Status ReopenWritableFile(const std::string& path, const rocksdb::FileOptions& options,
                            std::unique_ptr<rocksdb::FSWritableFile>* result, rocksdb::IODebugContext* debug) override {
    if (Status status = change(); !status.ok()) return status;
    return opened(target()->ReopenWritableFile(path, options, result, debug), path, false, result);
  }
  Status ReuseWritableFile(const std::string&, const std::string&, const rocksdb::FileOptions&,
                           std::unique_ptr<rocksdb::FSWritableFile>*, rocksdb::IODebugContext*) override {
    return Status::NotSupported("files are not used again");
  }
  Status NewRandomRWFile(const std::string& path, const rocksdb::FileOptions& options,
                         std::unique_ptr<rocksdb::FSRandomRWFile>* result, rocksdb::IODebugContext* debug) override {
    Status status = target()->NewRandomRWFile(path, options, result, debug);
    if (!status.ok()) return status;
    *result = std::make_unique<Overwritten>(std::move(*result), *this, file_at(path));
    return status;
  }
  Status NewDirectory(const std::string& path, const rocksdb::IOOptions& options,
                      std::unique_ptr<rocksdb::FSDirectory>* result, rocksdb::IODebugContext* debug) override {
    Status status = target()->NewDirectory(path, options, result, debug);
    if (status.ok()) *result = std::make_unique<Folder>(std::move(*result), *this, path);
    return status;
  }
  Status DeleteFile(const std::string& path, const rocksdb::IOOptions& options,
                    rocksdb::IODebugContext* debug) override {
    if (Status status = change(); !status.ok()) return status;
    if (!path.starts_with(root_)) return target()->DeleteFile(path, options, debug);
    if (!std::filesystem::exists(path)) return Status::PathNotFound(path);
    bury(path);
    return Status::OK();
  }
  Status RenameFile(const std::string& from, const std::string& to, const rocksdb::IOOptions& options,
                    rocksdb::IODebugContext* debug) override {
    if (Status status = change(); !status.ok()) return status;
    const std::shared_ptr<File> file = file_at(from);
    bury(to);
    Status status = target()->RenameFile(from, to, options, debug);
    const std::lock_guard lock(mutex_);
    if (!status.ok() || !to.starts_with(root_)) return status;
    file->place = to;
    now_.erase(from);
    now_[to] = file;
    return status;
  }
  Status LinkFile(const std::string&, const std::string&, const rocksdb::IOOptions&,
                  rocksdb::IODebugContext*) override {
    return Status::NotSupported("no links: copies");
  }
  Status GetFreeSpace(const std::string& path, const rocksdb::IOOptions& options, uint64_t* free,
                      rocksdb::IODebugContext* debug) override {
    if (!full_) return target()->GetFreeSpace(path, options, free, debug);
    *free = 0;
    return Status::OK();
  }

 private:
  static constexpr uint64_t kForEver = ~uint64_t{0};

  struct File {
    std::string place;                // current path of the file's bytes
    uint64_t synced = 0;              // number of bytes, from the start of the file, that are synced
    std::optional<std::string> held;  // synced content, if some of its bytes were overwritten since the sync
  };

  class Written final : public rocksdb::FSWritableFileOwnerWrapper {
   public:
    Written(std::unique_ptr<rocksdb::FSWritableFile> file, FaultyFiles& files, std::shared_ptr<File> state)
        : FSWritableFileOwnerWrapper(std::move(file)), files_(files), state_(std::move(state)) {}

    Status Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                  rocksdb::IODebugContext* debug) override {
      Status status = files_.write(*state_);
      if (status.ok()) return FSWritableFileOwnerWrapper::Append(data, options, debug);
      // If the disk becomes full during a write, a part of the data is written.
      if (!files_.stopped())
        FSWritableFileOwnerWrapper::Append({data.data(), data.size() / 2}, options, debug).PermitUncheckedError();
      return status;
    }
    Status Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options, const rocksdb::DataVerificationInfo&,
                  rocksdb::IODebugContext* debug) override {
      return Append(data, options, debug);
    }
    Status Truncate(uint64_t size, const rocksdb::IOOptions& options, rocksdb::IODebugContext* debug) override {
      if (Status status = files_.change(); !status.ok()) return status;
      {
        const std::lock_guard lock(files_.mutex_);
        state_->synced = std::min(state_->synced, size);
      }
      return FSWritableFileOwnerWrapper::Truncate(size, options, debug);
    }
    Status Sync(const rocksdb::IOOptions&, rocksdb::IODebugContext*) override { return files_.sync(*state_); }
    Status Fsync(const rocksdb::IOOptions&, rocksdb::IODebugContext*) override { return files_.sync(*state_); }
    Status RangeSync(uint64_t, uint64_t, const rocksdb::IOOptions&, rocksdb::IODebugContext*) override {
      return Status::OK();  // a range sync does not guarantee that data survives a power loss
    }
    Status Allocate(uint64_t, uint64_t, const rocksdb::IOOptions&, rocksdb::IODebugContext*) override {
      return Status::OK();
    }

   private:
    FaultyFiles& files_;
    const std::shared_ptr<File> state_;
  };

  class Overwritten final : public rocksdb::FSRandomRWFileOwnerWrapper {
   public:
    Overwritten(std::unique_ptr<rocksdb::FSRandomRWFile> file, FaultyFiles& files, std::shared_ptr<File> state)
        : FSRandomRWFileOwnerWrapper(std::move(file)), files_(files), state_(std::move(state)) {}

    Status Write(uint64_t offset, const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                 rocksdb::IODebugContext* debug) override {
      if (Status status = files_.write(*state_); !status.ok()) return status;
      {
        const std::lock_guard lock(files_.mutex_);
        if (!state_->held) state_->held = file_bytes(state_->place).substr(0, state_->synced);
      }
      return FSRandomRWFileOwnerWrapper::Write(offset, data, options, debug);
    }
    Status Sync(const rocksdb::IOOptions&, rocksdb::IODebugContext*) override { return files_.sync(*state_); }
    Status Fsync(const rocksdb::IOOptions&, rocksdb::IODebugContext*) override { return files_.sync(*state_); }

   private:
    FaultyFiles& files_;
    const std::shared_ptr<File> state_;
  };

  class Folder final : public rocksdb::FSDirectoryWrapper {
   public:
    Folder(std::unique_ptr<rocksdb::FSDirectory> folder, FaultyFiles& files, std::string path)
        : FSDirectoryWrapper(std::move(folder)), files_(files), path_(std::move(path)) {}

    Status Fsync(const rocksdb::IOOptions&, rocksdb::IODebugContext*) override { return files_.sync_folder(path_); }
    Status FsyncWithDirOptions(const rocksdb::IOOptions&, rocksdb::IODebugContext*,
                               const rocksdb::DirFsyncOptions&) override {
      return files_.sync_folder(path_);
    }

   private:
    FaultyFiles& files_;
    const std::string path_;
  };

  Status change() {
    uint64_t left = changes_left_;
    do {
      if (left == 0) return Status::IOError("the power is gone");
    } while (left != kForEver && !changes_left_.compare_exchange_weak(left, left - 1));
    ++changes_;
    return Status::OK();
  }
  static bool take(std::atomic<int64_t>& count, const std::string& path) {
    int64_t left = count;
    if (left > 0 && !path.ends_with(".log")) return false;
    while (left > 0 && !count.compare_exchange_weak(left, left - 1)) {
    }
    return left != 0;
  }
  Status write(const File& file) {
    if (Status status = change(); !status.ok()) return status;
    if (full_) return Status::NoSpace("the disk is full");
    return take(failing_writes_, file.place) ? Status::IOError("a write failed") : Status::OK();
  }
  Status sync(File& file) {
    if (Status status = change(); !status.ok()) return status;
    if (take(failing_syncs_, file.place)) return Status::IOError("a sync failed");
    const std::lock_guard lock(mutex_);
    std::error_code failed;
    const uint64_t size = std::filesystem::file_size(file.place, failed);
    if (!failed) file.synced = size;
    file.held.reset();
    return Status::OK();
  }
  Status sync_folder(const std::string& path) {
    if (Status status = change(); !status.ok()) return status;
    if (take(failing_syncs_, path)) return Status::IOError("a sync failed");
    const std::lock_guard lock(mutex_);
    const auto here = [&](const std::string& file) { return std::filesystem::path(file).parent_path() == path; };
    std::erase_if(durable_, [&](const auto& entry) { return here(entry.first); });
    for (const auto& [file, state] : now_) {
      if (here(file)) durable_[file] = state;
    }
    return Status::OK();
  }

  std::shared_ptr<File> file_at(const std::string& path) {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<File>& file = now_[path];
    if (file == nullptr) {
      file = std::make_shared<File>();
      file->place = path;
    }
    return file;
  }
  // Removes the file at `path`, but keeps its bytes in the graveyard, because the file exists again after a power loss.
  void bury(const std::string& path) {
    const std::lock_guard lock(mutex_);
    const auto file = now_.find(path);
    if (file == now_.end() || !std::filesystem::exists(path)) return;
    const std::string grave = graveyard_ + "/" + std::to_string(graves_++);
    std::filesystem::rename(path, grave);
    file->second->place = grave;
    now_.erase(file);
  }
  Status opened(Status status, const std::string& path, bool fresh, std::unique_ptr<rocksdb::FSWritableFile>* result) {
    if (!status.ok()) return status;
    if (fresh) {
      const std::lock_guard lock(mutex_);
      now_.erase(path);
    }
    *result = std::make_unique<Written>(std::move(*result), *this, file_at(path));
    return status;
  }

  const std::string root_;
  const std::string graveyard_;
  std::atomic<uint64_t> changes_left_ = kForEver;
  std::atomic<uint64_t> changes_ = 0;
  std::atomic<int64_t> failing_syncs_ = 0;
  std::atomic<int64_t> failing_writes_ = 0;
  std::atomic<bool> full_ = false;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<File>> now_;
  std::map<std::string, std::shared_ptr<File>> durable_;
  uint64_t graves_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_FAULTY_FILES_H_
