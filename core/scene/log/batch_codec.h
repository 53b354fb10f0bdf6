// Encodes and decodes update batches within records (record_codec.h, FORMAT.md). Plain functions; any thread.
#ifndef LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_

#include "core/scene/log/byte_codec.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Appends `batch` to `writer`. Precondition: `batch` has passed check_form(). O(bytes): copies each column.
void write_batch(const UpdateBatch& batch, ByteWriter& writer);
// Reads a batch whose columns borrow from the bytes of `reader`. If the batch does not pass check_form(), sets the
// error of `reader`.
UpdateBatch read_batch(ByteReader& reader);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
