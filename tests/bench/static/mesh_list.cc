#include "tests/bench/static/mesh_list.h"

#include <sys/stat.h>

#include "absl/strings/str_cat.h"

namespace locus::bench {
namespace {

// Generated meshes, from a city that fits into the first-level cache to a body larger than the last-level cache.
const std::vector<std::string> kGenerated = {"city:10000", "city:70000", "terrain:270000", "blob:4300000"};
const std::vector<std::string> kQuick = {"city:2000", "blob:5000"};

// A level from a Debian package, at the path where fetch_levels.sh puts it.
struct Fetched {
  const char* name;
  const char* file;
  const char* entry;  // entry of an archive, with the separator '#'; empty = the path is no archive
};
constexpr Fetched kFetched[] = {{"delta", "pak1-maps.pk3", "#maps/delta.bsp"}, {"bunny", "bunny.obj", ""}};

}  // namespace

std::vector<std::string> meshes_of(const Options& options, std::vector<std::string>& notes) {
  if (!options.meshes.empty()) return options.meshes;
  if (options.quick) return kQuick;
  std::vector<std::string> meshes = kGenerated;
  for (const Fetched& level : kFetched) {
    const std::string path = absl::StrCat(options.levels, "/", level.file);
    struct stat facts {};
    if (stat(path.c_str(), &facts) == 0)
      meshes.push_back(path + level.entry);
    else
      notes.push_back(
          absl::StrCat("the level ", level.name, " is left out: no ", path, "; run tests/bench/fetch_levels.sh"));
  }
  return meshes;
}

}  // namespace locus::bench
