#include "tests/bench/log/raw_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace locus::bench::log {
namespace {

absl::Status failed(const std::string& what) { return absl::ErrnoToStatus(errno, what); }

absl::Status write_at(int file, absl::string_view bytes, uint64_t place) {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(place));
    if (written < 0) return failed("write");
    bytes.remove_prefix(static_cast<size_t>(written));
    place += static_cast<uint64_t>(written);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<RawFile>> RawFile::create(const std::string& path, uint64_t reserved) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0) return failed(path);
  std::unique_ptr<RawFile> raw(new RawFile(file));
  const std::string zeros(size_t{1} << 20, '\0');
  for (uint64_t place = 0; place < reserved; place += zeros.size())
    if (absl::Status status = write_at(file, zeros, place); !status.ok()) return status;
  if (fsync(file) != 0) return failed(path);
  return raw;
}

RawFile::~RawFile() { close(file_); }

absl::Status RawFile::append(absl::string_view record) {
  if (absl::Status status = write_at(file_, record, written_); !status.ok()) return status;
  written_ += record.size();
  return fdatasync(file_) == 0 ? absl::OkStatus() : failed("fdatasync");
}

absl::StatusOr<std::string> RawFile::read_all() const {
  std::string all(written_, '\0');
  for (uint64_t place = 0; place < all.size();) {
    const ssize_t read = pread(file_, all.data() + place, all.size() - place, static_cast<off_t>(place));
    if (read <= 0) return failed("read");
    place += static_cast<uint64_t>(read);
  }
  return all;
}

}  // namespace locus::bench::log
