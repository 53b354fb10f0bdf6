#include "server/storage/rocksdb/catalogue.h"

#include <utility>

#include "core/base/check.h"
#include "server/storage/rocksdb/reading.h"

namespace locus::server {
namespace {

void put(rocksdb::WriteBatch& batch, rocksdb::ColumnFamilyHandle* meta, absl::string_view key,
         absl::string_view value) {
  LOCUS_CHECK(batch.Put(meta, slice_of(key), slice_of(value)).ok());
}

}  // namespace

Catalogue::Catalogue(Rows rows, uint64_t generation, SceneKey next_scene) : rows_(std::move(rows)) {
  totals_.generation = generation;
  totals_.next_scene = next_scene;
  add_sums(rows_, totals_);
}

uint64_t& Catalogue::sum_of(absl::string_view key, CatalogueRow& totals) {
  return key[0] == kSceneTag ? totals.scene_sum : totals.mesh_sum;
}

void Catalogue::add_sums(const Rows& rows, CatalogueRow& totals) {
  for (const auto& [key, value] : rows) sum_of(key, totals) += stored_checksum(value);
}

std::optional<absl::string_view> Catalogue::find(absl::string_view key) const {
  const auto row = rows_.find(key);
  return row == rows_.end() ? std::nullopt : verified(key, row->second);
}

CatalogueRow Catalogue::after(const CatalogueChange& change) const {
  CatalogueRow totals = totals_;
  ++totals.generation;
  if (change.next_scene != 0) totals.next_scene = change.next_scene;
  for (const CatalogueChange::Row& row : change.rows) {
    uint64_t& sum = sum_of(row.key, totals);
    if (const auto before = rows_.find(row.key); before != rows_.end()) sum -= stored_checksum(before->second);
    if (row.value) sum += stored_checksum(with_checksum(row.key, *row.value));
  }
  return totals;
}

void Catalogue::add_to(rocksdb::WriteBatch& batch, rocksdb::ColumnFamilyHandle* meta,
                       const CatalogueChange& change) const {
  for (const std::string& key : possibly_written_) {
    if (const auto row = rows_.find(key); row != rows_.end()) {
      put(batch, meta, key, row->second);
    } else {
      LOCUS_CHECK(batch.Delete(meta, key).ok());
    }
  }
  for (const CatalogueChange::Row& row : change.rows) {
    if (row.value) {
      put(batch, meta, row.key, with_checksum(row.key, *row.value));
    } else {
      LOCUS_CHECK(batch.Delete(meta, row.key).ok());
    }
  }
  put(batch, meta, kCatalogueKey, with_checksum(kCatalogueKey, encode(after(change))));
}

void Catalogue::apply(const CatalogueChange& change) {
  totals_ = after(change);
  for (const CatalogueChange::Row& row : change.rows) {
    if (row.value) {
      rows_[row.key] = with_checksum(row.key, *row.value);
      LOCUS_DCHECK(find(row.key) == *row.value);
    } else {
      rows_.erase(row.key);
    }
  }
  possibly_written_.clear();
}

void Catalogue::fail(const CatalogueChange& change) {
  for (const CatalogueChange::Row& row : change.rows) possibly_written_.insert(row.key);
}

}  // namespace locus::server
