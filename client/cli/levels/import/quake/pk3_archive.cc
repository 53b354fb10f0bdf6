#include "client/cli/levels/import/quake/pk3_archive.h"

#include <zip.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/input_file.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct DiscardArchive {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using Archive = std::unique_ptr<zip_t, DiscardArchive>;

struct CloseEntry {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

struct LevelEntry {
  std::string name;
  zip_uint64_t index = 0;
};

absl::Status unreadable(const std::string& path, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("cannot read ", path, " as a zip archive: ", why, "; copy it again"));
}

absl::StatusOr<Archive> open_archive(const std::string& path) {
  int code = 0;
  if (zip_t* archive = zip_open(path.c_str(), ZIP_RDONLY, &code)) return Archive(archive);
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string why = zip_error_strerror(&error);
  zip_error_fini(&error);
  return unreadable(path, why);
}

absl::StatusOr<std::vector<LevelEntry>> list_levels(zip_t* archive, const std::string& path) {
  const zip_int64_t count = zip_get_num_entries(archive, 0);
  if (count < 0 || count > kMaxArchiveEntries) {
    return unreadable(path, absl::StrCat(count, " entries, the limit is ", kMaxArchiveEntries));
  }
  std::vector<LevelEntry> levels;
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(count); ++i) {
    const char* name = zip_get_name(archive, i, 0);
    if (name != nullptr && lower_extension(name) == ".bsp") levels.push_back({name, i});
  }
  if (levels.empty()) {
    return absl::NotFoundError(absl::StrCat(path, " holds no .bsp level: give an archive with maps"));
  }
  std::sort(levels.begin(), levels.end(), [](const LevelEntry& a, const LevelEntry& b) {
    return std::pair(a.name, a.index) < std::pair(b.name, b.index);
  });
  return levels;
}

std::vector<std::string> names_of(const std::vector<LevelEntry>& levels) {
  std::vector<std::string> names;
  names.reserve(levels.size());
  for (const LevelEntry& level : levels) names.push_back(level.name);
  return names;
}

std::string listing(std::vector<std::string> names) {
  const size_t all = names.size();
  names.resize(std::min(all, kMaxListedEntries));
  return absl::StrCat(absl::StrJoin(names, ", "), all > names.size() ? ", ..." : "");
}

absl::StatusOr<size_t> choose_level(const std::vector<LevelEntry>& levels, const std::string& path,
                                    const std::string& entry) {
  if (entry.empty()) return 0;
  for (size_t i = 0; i < levels.size(); ++i) {
    if (levels[i].name == entry) return i;
  }
  for (size_t i = 0; i < levels.size(); ++i) {
    const std::string stem = file_stem(levels[i].name);
    if (absl::EqualsIgnoreCase(levels[i].name, entry) || absl::EqualsIgnoreCase(stem, entry) ||
        absl::EqualsIgnoreCase(absl::StrCat(stem, ".bsp"), entry)) {
      return i;
    }
  }
  return absl::NotFoundError(
      absl::StrCat("no level ", entry, " in ", path, ": choose one of ", listing(names_of(levels))));
}

absl::StatusOr<std::string> unpack(zip_t* archive, const LevelEntry& level, const std::string& path) {
  const std::unique_ptr<zip_file_t, CloseEntry> file(zip_fopen_index(archive, level.index, 0));
  if (file == nullptr) return unreadable(path, absl::StrCat(level.name, ": ", zip_strerror(archive)));
  // Count the unpacked bytes, since the size that the archive declares is untrusted.
  std::string bytes;
  std::array<char, 1 << 16> chunk;
  while (true) {
    const zip_int64_t got = zip_fread(file.get(), chunk.data(), chunk.size());
    if (got < 0) return unreadable(path, absl::StrCat(level.name, ": ", zip_file_strerror(file.get())));
    if (got == 0) return bytes;
    if (static_cast<size_t>(got) > kMaxBspBytes - bytes.size()) {
      return absl::ResourceExhaustedError(
          absl::StrCat(level.name, " in ", path, " unpacks to more than ", kMaxBspBytes, " bytes: give another level"));
    }
    bytes.append(chunk.data(), static_cast<size_t>(got));
  }
}

}  // namespace

absl::StatusOr<Pk3Level> read_pk3_level(const std::string& path, const std::string& entry) {
  ASSIGN_OR_RETURN(const Archive archive, open_archive(path));
  ASSIGN_OR_RETURN(const std::vector<LevelEntry> levels, list_levels(archive.get(), path));
  ASSIGN_OR_RETURN(const size_t chosen, choose_level(levels, path, entry));
  ASSIGN_OR_RETURN(std::string bytes, unpack(archive.get(), levels[chosen], path));

  Pk3Level level{levels[chosen].name, std::move(bytes), names_of(levels)};
  level.others.erase(level.others.begin() + static_cast<std::ptrdiff_t>(chosen));
  return level;
}

}  // namespace locus::cli
