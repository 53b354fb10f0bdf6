// Folder for one test. The destructor removes the folder with its content.
#ifndef LOCUS_TESTS_SUPPORT_TEMPORARY_FOLDER_H_
#define LOCUS_TESTS_SUPPORT_TEMPORARY_FOLDER_H_

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace locus::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string path = "/tmp/locus-test-XXXXXX";
    if (mkdtemp(path.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
    path_ = path;
  }
  ~TemporaryFolder() {
    std::error_code why;
    std::filesystem::remove_all(path_, why);
    EXPECT_FALSE(why) << path_ << ": " << why.message();
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string file(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_TEMPORARY_FOLDER_H_
