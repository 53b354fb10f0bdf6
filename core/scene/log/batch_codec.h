// Encodes and decodes update batches within records (record_codec.h, FORMAT.md). Plain functions; any thread.
#ifndef LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_

#include "core/scene/log/byte_codec.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Appends the batch. Precondition: `batch` has passed check_form(). O(bytes): copies each column.
void write_batch(const UpdateBatch& batch, ByteWriter& writer);
// Reads a batch that borrows from the bytes. The batch passes check_form(), or the reader fails.
UpdateBatch read_batch(ByteReader& reader);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
