#include "core/scene/log/byte_codec.h"

#include "absl/strings/str_cat.h"

namespace locus {

void ByteReader::fail(absl::string_view what, absl::string_view how) {
  if (!good()) return;
  status_ = data_loss(absl::StrCat(what, " ", how));
  left_ = {};
  LOCUS_DCHECK(!good());
}

BytesKind read_kind(ByteReader& reader) {
  const ByteReader::Pair pair = reader.pair("the kind");
  if (reader.good() && pair.second != kBytesVersion)
    reader.fail(absl::StrCat("version ", pair.second), absl::StrCat("is not the known version ", kBytesVersion,
                                                                    ": a later program wrote it, or it is damaged"));
  return static_cast<BytesKind>(pair.first);
}

}  // namespace locus
