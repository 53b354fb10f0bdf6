// A new folder under TMPDIR, or under /tmp if TMPDIR is not set; the destructor removes it with its content. Used by
// suites that write files. One thread at a time.
#ifndef LOCUS_TESTS_BENCH_FRAME_TEMPORARY_FOLDER_H_
#define LOCUS_TESTS_BENCH_FRAME_TEMPORARY_FOLDER_H_

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace locus::bench {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code ignored;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(ignored);
    path_ = ((ignored ? "/tmp" : parent) / "locus-bench-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr) path_.clear();
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string file(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_TEMPORARY_FOLDER_H_
