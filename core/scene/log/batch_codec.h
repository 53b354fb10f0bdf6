// Update batches as bytes: what record_codec.h is made of. Any thread.
#ifndef LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_

#include "core/scene/log/byte_codec.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// `batch` has passed check_form(). O(columns), a copy of each.
void write_batch(const UpdateBatch& batch, ByteWriter& writer);
// Borrows from the bytes. One that passes check_form(), or the reader fails.
UpdateBatch read_batch(ByteReader& reader);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_BATCH_CODEC_H_
