// The folder `outlines` of a data directory: a file for each mesh's outline, named by the mesh's content, which may be
// taken away at any time. Nothing here fails: what cannot be written is not kept, and what is not as it was written is
// not read. So files are not synced either. Files of other names are left alone.
//
// Threads: any, of one content one at a time.
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

  // Below the data directory `path`.
  TopologyFiles(rocksdb::Env& env, absl::string_view path);

  void keep(const Sha256& sha256, absl::string_view bytes);
  std::optional<std::string> read(const Sha256& sha256) const;
  void drop(const Sha256& sha256);
  // All of no content in `used`, and what a process left unfinished.
  void drop_all_but(const std::set<Sha256>& used);

 private:
  std::string path_of(const std::string& name) const;

  rocksdb::Env& env_;
  const std::string folder_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_TOPOLOGY_FILES_H_
