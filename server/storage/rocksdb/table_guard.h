// File system that refuses to open tables (.sst files) whose properties block is damaged. RocksDB uses that block
// before it verifies the block's checksum, and Debian's build of RocksDB aborts the process if the block is damaged.
// With this guard RocksDB returns an error instead, as it does if another part of a table is damaged.
//
// Threads: any thread, as rocksdb::FileSystem requires.
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
  // Opens a file. Returns Corruption if the file is a table and its footer is malformed, or its metaindex or properties
  // block does not match the block's checksum.
  rocksdb::IOStatus NewRandomAccessFile(const std::string& path, const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* file,
                                        rocksdb::IODebugContext* context) override;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_TABLE_GUARD_H_
