#include "server/storage/integrity/high_water.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/storage/rocksdb/bytes.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {
namespace {

constexpr absl::string_view kMagic = "locusHW1";
constexpr size_t kFirstSlotBytes = 4096;
constexpr size_t kMaxFileBytes = size_t{64} << 20;
constexpr size_t kFrameBytes = 8 + 4 + 8;  // magic, length, checksum

std::string framed(const std::string& bytes) {
  ByteWriter out;
  out.bytes(kMagic).string(bytes);
  const uint64_t sum = checksum(out.view());
  return out.u64(sum).take();
}

std::optional<HighWater> unframed(absl::string_view slot) {
  ByteReader in(slot);
  if (in.bytes(kMagic.size()) != kMagic) return std::nullopt;
  const absl::string_view bytes = in.bytes(in.u32());
  const size_t summed = slot.size() - in.rest().size();
  const uint64_t sum = in.u64();
  if (!in.ok() || sum != checksum(slot.substr(0, summed))) return std::nullopt;
  return decode_high_water(bytes);
}

std::string path_of(const std::string& folder) { return absl::StrCat(folder, "/", HighWaterFile::kName); }

absl::Status error(const std::string& folder, const rocksdb::Status& status) {
  return disk_error(absl::StrCat("writing ", path_of(folder)), status);
}

}  // namespace

std::string encode(const HighWater& high_water) {
  ByteWriter out;
  out.u64(high_water.number).u8(high_water.closed ? 1 : 0).u64(high_water.catalogue).u64(high_water.next_scene);
  out.u64(high_water.mesh_sum).u64(high_water.covered_sequence).string(high_water.manifest);
  out.u64(high_water.manifest_bytes).string(high_water.catalogue_damage);
  out.u32(static_cast<uint32_t>(high_water.marks.size()));
  for (const Mark& mark : high_water.marks) {
    out.u64(mark.scene).string(mark.name).u64(mark.sequence).u64(mark.chain).u64(mark.row_seal);
    out.u8(mark.copied ? 1 : 0).string(mark.damage);
  }
  return out.take();
}

std::optional<HighWater> decode_high_water(absl::string_view bytes) {
  ByteReader in(bytes);
  HighWater found;
  found.number = in.u64();
  found.closed = in.u8() != 0;
  found.catalogue = in.u64();
  found.next_scene = in.u64();
  found.mesh_sum = in.u64();
  found.covered_sequence = in.u64();
  found.manifest = in.string();
  found.manifest_bytes = in.u64();
  found.catalogue_damage = in.string();
  const uint32_t count = in.u32();
  for (uint32_t i = 0; i < count && in.ok(); ++i) {
    Mark& mark = found.marks.emplace_back();
    mark.scene = in.u64();
    mark.name = in.string();
    mark.sequence = in.u64();
    mark.chain = in.u64();
    mark.row_seal = in.u64();
    mark.copied = in.u8() != 0;
    mark.damage = in.string();
  }
  return in.ended() ? std::optional(std::move(found)) : std::nullopt;
}

absl::StatusOr<HighWater> HighWaterFile::read(rocksdb::Env& env, const std::string& folder) {
  const std::string path = path_of(folder);
  uint64_t size = 0;
  rocksdb::Status status = env.FileExists(path);
  if (status.IsNotFound()) return absl::NotFoundError(absl::StrCat(path, " is missing"));
  if (status.ok()) status = env.GetFileSize(path, &size);
  std::string bytes;
  if (status.ok() && size <= kMaxFileBytes) status = rocksdb::ReadFileToString(&env, path, &bytes);
  if (!status.ok()) return disk_error(absl::StrCat("reading ", path), status);
  std::optional<HighWater> newest;
  // A file that was cut still has its first slot where it was; of the second nobody knows.
  for (const size_t start : {size_t{0}, bytes.size() / 2}) {
    std::optional<HighWater> found = unframed(absl::string_view(bytes).substr(start));
    if (found && (!newest || newest->number < found->number)) newest = std::move(found);
  }
  if (!newest) return absl::DataLossError(absl::StrCat(path, " cannot be read"));
  return *newest;
}

absl::Status HighWaterFile::write(HighWater& high_water) {
  ++high_water.number;
  const std::string slot = framed(encode(high_water));
  if (file_ == nullptr || slot.size() > slot_bytes_) {
    --high_water.number;
    return replace(high_water);
  }
  rocksdb::Status status = file_->Write(high_water.number % 2 * slot_bytes_, slot);
  if (status.ok()) status = file_->Sync();
  if (!status.ok()) file_ = nullptr;  // what is in it now is not known: make another
  return status.ok() ? absl::OkStatus() : error(folder_, status);
}

absl::Status HighWaterFile::replace(HighWater& high_water) {
  file_ = nullptr;
  std::string bytes;
  high_water.number += 2 - high_water.number % 2;
  HighWater second = high_water;
  ++second.number;
  const std::string slots[2] = {framed(encode(high_water)), framed(encode(second))};
  slot_bytes_ = kFirstSlotBytes;
  while (slot_bytes_ < slots[0].size() * 2) slot_bytes_ *= 2;
  for (const std::string& slot : slots) bytes.append(slot).append(slot_bytes_ - slot.size(), '\0');
  high_water.number = second.number;

  const std::string path = path_of(folder_);
  const std::string fresh = path + ".new";
  rocksdb::Status status = rocksdb::WriteStringToFile(&env_, bytes, fresh, true);
  if (status.ok()) status = env_.RenameFile(fresh, path);
  if (status.ok()) status = sync_folder(env_, folder_);
  if (status.ok()) status = env_.NewRandomRWFile(path, &file_, rocksdb::EnvOptions());
  return status.ok() ? absl::OkStatus() : error(folder_, status);
}

}  // namespace locus::server
