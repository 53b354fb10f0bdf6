// The folder outlines/ of a data directory: a cache of the tree topologies of meshes. The folder has one file for each
// mesh content (vertices and triangles), named by the content's SHA-256. Any file may be deleted at any time, because
// the tree can be built without it. For the same reason files are not synced, and no function returns an error: keep()
// ignores a failed write, and read() returns no value if a file has a wrong checksum. Files with other names are never
// changed.
//
// Threads: any thread; calls for the same SHA-256 must not overlap.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_TOPOLOGY_FILES_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_TOPOLOGY_FILES_H_

#include <optional>
#include <set>
#include <string>

#include "absl/strings/string_view.h"
#include "rocksdb/env.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

class TopologyFiles {
 public:
  static constexpr absl::string_view kFolder = "outlines";

  // Uses the folder outlines/ in the data directory `path`.
  TopologyFiles(rocksdb::Env& env, absl::string_view path);

  void keep(const Sha256& sha256, absl::string_view bytes);
  std::optional<std::string> read(const Sha256& sha256) const;
  void drop(const Sha256& sha256);
  // Deletes every topology file whose SHA-256 is not in `used`, and temporary files of interrupted calls of keep().
  void drop_unused(const std::set<Sha256>& used);

 private:
  std::string path_of(const std::string& name) const;

  rocksdb::Env& env_;
  const std::string folder_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_TOPOLOGY_FILES_H_
