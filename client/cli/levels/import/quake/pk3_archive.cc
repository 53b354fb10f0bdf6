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
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/import_error.h"
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
  uint64_t packed_bytes = 0;  // declared size, at most the size of the archive
};

absl::Status unreadable(const std::string& path, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("cannot read ", path, " as a zip archive: ", why, "; copy it again"));
}

// Opens the archive whose content is `bytes`. `bytes` must outlive the result.
absl::StatusOr<Archive> open_archive(absl::string_view bytes, const std::string& path) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* const archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  const std::string why = zip_error_strerror(&error);
  zip_error_fini(&error);
  if (archive != nullptr) return Archive(archive);
  if (source != nullptr) zip_source_free(source);
  return unreadable(path, why);
}

absl::StatusOr<std::vector<LevelEntry>> list_levels(zip_t* archive, uint64_t archive_bytes, const std::string& path) {
  const zip_int64_t count = zip_get_num_entries(archive, 0);
  if (count < 0 || count > kMaxArchiveEntries) {
    return exceeds(path, absl::StrCat(count, " entries"), "archive_entries", kMaxArchiveEntries,
                   "give an archive with fewer files");
  }
  std::vector<LevelEntry> levels;
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(count); ++i) {
    zip_stat_t stat;
    if (zip_stat_index(archive, i, 0, &stat) != 0 || (stat.valid & ZIP_STAT_NAME) == 0) continue;
    const absl::string_view name = stat.name;
    if (name.size() > kMaxEntryNameBytes) {
      return exceeds(path, absl::StrCat("an entry whose name has ", name.size(), " bytes"), "entry_name_bytes",
                     kMaxEntryNameBytes, "rename the entry");
    }
    if (lower_extension(name) != ".bsp") continue;
    const uint64_t packed = (stat.valid & ZIP_STAT_COMP_SIZE) == 0 ? 0 : uint64_t{stat.comp_size};
    levels.push_back({std::string(name), i, std::min(packed, archive_bytes)});
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
  return absl::StrCat(clean_text(absl::StrJoin(names, ", "), kMaxListedBytes), all > names.size() ? ", ..." : "");
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

// Returns RESOURCE_EXHAUSTED if a level of which `bytes` bytes have been unpacked so far exceeds a limit.
absl::Status check_unpacked(uint64_t bytes, const LevelEntry& level, const std::string& path) {
  if (bytes > kMaxBspBytes) {
    return exceeds(absl::StrCat(level.name, " in ", path), "more bytes unpacked", "level_bytes", kMaxBspBytes,
                   "give another level");
  }
  if (bytes > kMinCheckedBytes && bytes / kMaxArchiveRatio > level.packed_bytes) {
    return exceeds(absl::StrCat(level.name, " in ", path),
                   absl::StrCat("more than ", kMaxArchiveRatio, " unpacked bytes for each of its ", level.packed_bytes,
                                " packed bytes"),
                   "archive_ratio", kMaxArchiveRatio, "pack the level again, or give the .bsp file itself");
  }
  return absl::OkStatus();
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
    RETURN_IF_ERROR(check_unpacked(bytes.size() + static_cast<uint64_t>(got), level, path));
    bytes.append(chunk.data(), static_cast<size_t>(got));
  }
}

}  // namespace

absl::StatusOr<Pk3Level> read_pk3_level(absl::string_view archive, const std::string& name, const std::string& entry) {
  ASSIGN_OR_RETURN(const Archive opened, open_archive(archive, name));
  ASSIGN_OR_RETURN(const std::vector<LevelEntry> levels, list_levels(opened.get(), archive.size(), name));
  ASSIGN_OR_RETURN(const size_t chosen, choose_level(levels, name, entry));
  ASSIGN_OR_RETURN(std::string bytes, unpack(opened.get(), levels[chosen], name));

  Pk3Level level{levels[chosen].name, std::move(bytes), names_of(levels)};
  level.others.erase(level.others.begin() + static_cast<std::ptrdiff_t>(chosen));
  return level;
}

}  // namespace locus::cli
