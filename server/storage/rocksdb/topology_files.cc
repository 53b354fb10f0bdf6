#include "server/storage/rocksdb/topology_files.h"

#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/limits.h"

namespace locus::server {
namespace {

constexpr absl::string_view kUnfinished = ".new";
// Upper bound of the size of any topology file. Larger files were not written by this class and are not read.
constexpr uint64_t kMaxTopologyBytes = uint64_t{8} * limits::kMaxMeshTriangles;

std::string name_of(const Sha256& sha256) {
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(sha256.data()), sha256.size()));
}

// Returns whether `name` is the name of a topology file or of a temporary file of an interrupted keep().
bool is_topology_name(absl::string_view name) {
  name = absl::StripSuffix(name, kUnfinished);
  return name.size() == 2 * Sha256().size() && name.find_first_not_of("0123456789abcdef") == name.npos;
}

}  // namespace

TopologyFiles::TopologyFiles(rocksdb::Env& env, absl::string_view path)
    : env_(env), folder_(absl::StrCat(path, "/", kFolder)) {}

std::string TopologyFiles::path_of(const std::string& name) const { return absl::StrCat(folder_, "/", name); }

void TopologyFiles::keep(const Sha256& sha256, absl::string_view bytes) {
  const std::string name = name_of(sha256);
  const std::string unfinished = absl::StrCat(path_of(name), kUnfinished);
  rocksdb::Status status = env_.CreateDirIfMissing(folder_);
  if (status.ok()) status = rocksdb::WriteStringToFile(&env_, with_checksum(name, bytes), unfinished);
  if (status.ok()) status = env_.RenameFile(unfinished, path_of(name));
  if (!status.ok()) env_.DeleteFile(unfinished).PermitUncheckedError();
}

std::optional<std::string> TopologyFiles::read(const Sha256& sha256) const {
  const std::string name = name_of(sha256);
  std::string bytes;
  uint64_t size = 0;
  if (!env_.GetFileSize(path_of(name), &size).ok() || size > kMaxTopologyBytes) return std::nullopt;
  if (!rocksdb::ReadFileToString(&env_, path_of(name), &bytes).ok()) return std::nullopt;
  const std::optional<absl::string_view> found = verified(name, bytes);
  if (!found) return std::nullopt;
  bytes.resize(found->size());
  return bytes;
}

void TopologyFiles::drop(const Sha256& sha256) { env_.DeleteFile(path_of(name_of(sha256))).PermitUncheckedError(); }

void TopologyFiles::drop_unused(const std::set<Sha256>& used) {
  std::set<std::string> names;
  for (const Sha256& sha256 : used) names.insert(name_of(sha256));
  std::vector<std::string> present;
  if (!env_.GetChildren(folder_, &present).ok()) return;
  for (const std::string& name : present) {
    if (is_topology_name(name) && !names.contains(name)) env_.DeleteFile(path_of(name)).PermitUncheckedError();
  }
}

}  // namespace locus::server
