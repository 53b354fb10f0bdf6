#include "client/cli/rows/bulk/byte_input.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

std::string words_of(int error) { return std::generic_category().message(error); }

}  // namespace

absl::StatusOr<ByteInput> ByteInput::open(const std::string& path) {
  if (path == "-") return ByteInput(STDIN_FILENO, "stdin");
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 && errno == ENOENT) return absl::NotFoundError(absl::StrCat("no file ", path, ": check the path"));
  if (descriptor < 0) return absl::InvalidArgumentError(absl::StrCat("cannot open ", path, ": ", words_of(errno)));
  ByteInput input(descriptor, path);
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return input;
  if (S_ISDIR(status.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is a folder: give a file, or - for the standard input"));
  }
  if (S_ISREG(status.st_mode)) input.size_ = static_cast<uint64_t>(status.st_size);
  return input;
}

ByteInput::ByteInput(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}

ByteInput::ByteInput(ByteInput&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      name_(std::move(other.name_)),
      size_(other.size_),
      read_(other.read_) {}

ByteInput::~ByteInput() {
  if (descriptor_ > STDIN_FILENO) close(descriptor_);
}

absl::StatusOr<size_t> ByteInput::read(absl::Span<char> buffer) {
  while (true) {
    const ssize_t count = ::read(descriptor_, buffer.data(), buffer.size());
    if (count >= 0) {
      read_ += static_cast<uint64_t>(count);
      return static_cast<size_t>(count);
    }
    if (errno != EINTR) return absl::UnknownError(absl::StrCat("cannot read ", name_, ": ", words_of(errno)));
  }
}

bool ByteInput::ready_within(std::chrono::milliseconds wait) const {
  struct pollfd poll_of = {.fd = descriptor_, .events = POLLIN, .revents = 0};
  const int ready = poll(&poll_of, 1, static_cast<int>(wait.count()));
  return ready != 0;  // an error counts as ready: the next read() reports it
}

}  // namespace locus::cli
