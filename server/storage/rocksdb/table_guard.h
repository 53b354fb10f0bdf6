// Keeps RocksDB from tables whose properties are damaged. It looks into that block before it compares the checksum, and
// Debian's build ends the process over what it then finds. Here such a table cannot be opened, like any other that is
// damaged.
//
// Threads: as of rocksdb::FileSystem.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_TABLE_GUARD_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_TABLE_GUARD_H_

#include <memory>
#include <string>

#include "rocksdb/file_system.h"

namespace locus::server {

class TableGuard final : public rocksdb::FileSystemWrapper {
 public:
  explicit TableGuard(const std::shared_ptr<rocksdb::FileSystem>& files) : FileSystemWrapper(files) {}

  const char* Name() const override { return "locus.TableGuard"; }
  // Corruption for a table whose last blocks are not what was written.
  rocksdb::IOStatus NewRandomAccessFile(const std::string& path, const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* file,
                                        rocksdb::IODebugContext* context) override;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_TABLE_GUARD_H_
