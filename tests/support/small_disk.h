// File system of a few MiB in memory, mounted on a folder: for tests that fill the disk or make it read-only. Needs
// root; mounted() returns whether mounting succeeded. The destructor unmounts it.
#ifndef LOCUS_TESTS_SUPPORT_SMALL_DISK_H_
#define LOCUS_TESTS_SUPPORT_SMALL_DISK_H_

#include <sys/mount.h>

#include <filesystem>
#include <string>
#include <utility>

namespace locus::test {

class SmallDisk {
 public:
  SmallDisk(std::string path, int mebibytes) : path_(std::move(path)) {
    std::filesystem::create_directories(path_);
    const std::string size = "size=" + std::to_string(mebibytes) + "m";
    mounted_ = mount("locus-test", path_.c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool mounted() const { return mounted_; }
  // Makes the file system read-only. Fails and returns false while a file on it is open for writing.
  bool make_read_only() { return mount("", path_.c_str(), "", MS_REMOUNT | MS_RDONLY, "") == 0; }

 private:
  const std::string path_;
  bool mounted_ = false;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SMALL_DISK_H_
