// The catalogue: the rows of all scenes and meshes, which RocksDB stores in the column family meta. This class keeps a
// copy of the rows in memory, with the sums of their checksums; the sums reveal a row that was lost, changed or
// restored from an earlier time. Each change is one write batch and increments the catalogue's generation.
//
// A batch whose write failed may still be in RocksDB's log and reappear after a restart. Therefore the next change
// rewrites every row that a failed change contained.
//
// Threads: only one thread at a time may use a Catalogue.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_CATALOGUE_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_CATALOGUE_H_

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "rocksdb/write_batch.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

// Change of the catalogue. A row with a value is stored; a row without a value is deleted. The values do not include
// the checksum, which add_to() appends.
struct CatalogueChange {
  struct Row {
    std::string key;
    std::optional<std::string> value;
  };
  std::vector<Row> rows;
  SceneKey next_scene = 0;  // next free scene key after the change; 0 = unchanged
};

class Catalogue {
 public:
  // Rows by key. Each value ends with the row's checksum.
  using Rows = std::map<std::string, std::string, std::less<>>;

  Catalogue() = default;
  // Constructs the catalogue from the rows that were read from the disk. `next_scene` is the next free scene key.
  Catalogue(Rows rows, uint64_t generation, SceneKey next_scene);

  const CatalogueRow& totals() const { return totals_; }
  const Rows& rows() const { return rows_; }
  // Returns the value of the row `key` without the checksum; no value if the catalogue has no such row.
  std::optional<absl::string_view> find(absl::string_view key) const;

  // Adds to `batch`, in the column family `meta`, the rows of `change`, the current state of every row that a failed
  // change contained, and the new totals. The caller writes the batch, then calls apply(change) if the write succeeded
  // and fail(change) otherwise.
  void add_to(rocksdb::WriteBatch& batch, rocksdb::ColumnFamilyHandle* meta, const CatalogueChange& change) const;
  void apply(const CatalogueChange& change);
  void fail(const CatalogueChange& change);

  // Adds the checksums of the scene rows among `rows` to `totals.scene_sum`, those of all other rows to
  // `totals.mesh_sum`.
  static void add_sums(const Rows& rows, CatalogueRow& totals);

 private:
  static uint64_t& sum_of(absl::string_view key, CatalogueRow& totals);
  // Returns the totals that the catalogue has after `change`.
  CatalogueRow after(const CatalogueChange& change) const;

  Rows rows_;
  CatalogueRow totals_;
  std::set<std::string, std::less<>> possibly_written_;  // keys of rows in failed changes, which may be on the disk
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_CATALOGUE_H_
