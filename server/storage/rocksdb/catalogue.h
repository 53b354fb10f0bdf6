// The catalogue: which scenes and meshes there are. Its rows stand in the column family meta; here they are kept in
// memory, with the sums by which a row that was lost, changed or came back is noticed. A change is one batch, numbered
// without gaps.
//
// A change that failed may turn up after a restart, since the log may have it all the same. The next one therefore puts
// the rows it touched right again.
//
// Threads: one at a time.
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

// Rows to put or, without a value, to delete. Values are not sealed yet.
struct CatalogueChange {
  struct Row {
    std::string key;
    std::optional<std::string> value;
  };
  std::vector<Row> rows;
  SceneKey next_scene = 0;  // 0 = as it was
};

class Catalogue {
 public:
  // By key, sealed.
  using Rows = std::map<std::string, std::string, std::less<>>;

  Catalogue() = default;
  // As found on the disk.
  Catalogue(Rows rows, uint64_t generation, SceneKey next_scene);

  const CatalogueRow& totals() const { return totals_; }
  const Rows& rows() const { return rows_; }
  // The bytes of a row, or nothing.
  std::optional<absl::string_view> find(absl::string_view key) const;

  // Writes the change into `batch`; then the batch is written, and one of the two below is called.
  void add_to(rocksdb::WriteBatch& batch, rocksdb::ColumnFamilyHandle* meta, const CatalogueChange& change) const;
  void apply(const CatalogueChange& change);
  void fail(const CatalogueChange& change);

  // The sums of a set of rows.
  static void add_sums(const Rows& rows, CatalogueRow& totals);

 private:
  static uint64_t& sum_of(absl::string_view key, CatalogueRow& totals);
  // Totals after the change.
  CatalogueRow after(const CatalogueChange& change) const;

  Rows rows_;
  CatalogueRow totals_;
  std::set<std::string, std::less<>> possibly_written_;  // keys that failed changes touched
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_CATALOGUE_H_
