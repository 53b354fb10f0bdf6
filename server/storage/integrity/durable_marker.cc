#include "server/storage/integrity/durable_marker.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/rows.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr absl::string_view kMagic = "locusHW1";
constexpr size_t kFirstSlotBytes = 4096;
constexpr size_t kMaxFileBytes = size_t{64} << 20;

std::string framed(const std::string& bytes) {
  RowWriter out;
  out.bytes(kMagic).string(bytes);
  const uint64_t sum = checksum(out.view());
  return out.u64(sum).take();
}

std::optional<DurableMarker> unframed(absl::string_view slot) {
  RowReader in(slot);
  if (in.bytes(kMagic.size()) != kMagic) return std::nullopt;
  const absl::string_view bytes = in.bytes(in.u32());
  const size_t summed = slot.size() - in.rest().size();
  const uint64_t sum = in.u64();
  if (!in.ok() || sum != checksum(slot.substr(0, summed))) return std::nullopt;
  return decode_durable_marker(bytes);
}

std::string path_of(const std::string& folder) { return absl::StrCat(folder, "/", DurableMarkerFile::kName); }

absl::Status error(const std::string& folder, const rocksdb::Status& status) {
  return disk_error(absl::StrCat("writing ", path_of(folder)), status);
}

}  // namespace

std::string encode(const DurableMarker& durable_marker) {
  RowWriter out;
  out.u64(durable_marker.write_number)
      .u8(durable_marker.closed ? 1 : 0)
      .u64(durable_marker.catalogue)
      .u64(durable_marker.next_scene);
  out.u64(durable_marker.mesh_sum).u64(durable_marker.flushed_sequence).string(durable_marker.manifest);
  out.u64(durable_marker.manifest_bytes).string(durable_marker.catalogue_damage);
  out.u32(static_cast<uint32_t>(durable_marker.scene_markers.size()));
  for (const SceneMarker& scene_marker : durable_marker.scene_markers) {
    out.u64(scene_marker.scene)
        .string(scene_marker.name)
        .u64(scene_marker.sequence)
        .u64(scene_marker.running_checksum)
        .u64(scene_marker.row_checksum);
    out.u8(scene_marker.copied ? 1 : 0).string(scene_marker.damage);
  }
  return out.take();
}

std::optional<DurableMarker> decode_durable_marker(absl::string_view bytes) {
  RowReader in(bytes);
  DurableMarker found;
  found.write_number = in.u64();
  found.closed = in.u8() != 0;
  found.catalogue = in.u64();
  found.next_scene = in.u64();
  found.mesh_sum = in.u64();
  found.flushed_sequence = in.u64();
  found.manifest = in.string();
  found.manifest_bytes = in.u64();
  found.catalogue_damage = in.string();
  const uint32_t count = in.u32();
  for (uint32_t i = 0; i < count && in.ok(); ++i) {
    SceneMarker& scene_marker = found.scene_markers.emplace_back();
    scene_marker.scene = in.u64();
    scene_marker.name = in.string();
    scene_marker.sequence = in.u64();
    scene_marker.running_checksum = in.u64();
    scene_marker.row_checksum = in.u64();
    scene_marker.copied = in.u8() != 0;
    scene_marker.damage = in.string();
  }
  return in.ended() ? std::optional(std::move(found)) : std::nullopt;
}

absl::StatusOr<DurableMarker> DurableMarkerFile::read(rocksdb::Env& env, const std::string& folder) {
  const std::string path = path_of(folder);
  uint64_t size = 0;
  rocksdb::Status status = env.FileExists(path);
  if (status.IsNotFound()) return absl::NotFoundError(absl::StrCat(path, " is missing"));
  if (status.ok()) status = env.GetFileSize(path, &size);
  std::string bytes;
  if (status.ok() && size <= kMaxFileBytes) status = rocksdb::ReadFileToString(&env, path, &bytes);
  if (!status.ok()) return disk_error(absl::StrCat("reading ", path), status);
  std::optional<DurableMarker> newest;
  // The second slot begins at half the file's size. If the file was truncated, only the first slot is found.
  for (const size_t start : {size_t{0}, bytes.size() / 2}) {
    std::optional<DurableMarker> found = unframed(absl::string_view(bytes).substr(start));
    if (found && (!newest || newest->write_number < found->write_number)) newest = std::move(found);
  }
  if (!newest) return absl::DataLossError(absl::StrCat(path, " cannot be read"));
  return *newest;
}

absl::Status DurableMarkerFile::write(DurableMarker& durable_marker) {
  ++durable_marker.write_number;
  const std::string slot = framed(encode(durable_marker));
  if (file_ == nullptr || slot.size() > slot_bytes_) {
    --durable_marker.write_number;
    return replace(durable_marker);
  }
  LOCUS_DCHECK_LE(slot.size(), slot_bytes_);
  rocksdb::Status status = file_->Write(durable_marker.write_number % 2 * slot_bytes_, slot);
  if (status.ok()) status = file_->Sync();
  if (!status.ok()) file_ = nullptr;  // the slot's content is unknown, so the next write() replaces the file
  return status.ok() ? absl::OkStatus() : error(folder_, status);
}

absl::Status DurableMarkerFile::replace(DurableMarker& durable_marker) {
  file_ = nullptr;
  std::string bytes;
  durable_marker.write_number += 2 - durable_marker.write_number % 2;
  DurableMarker second = durable_marker;
  ++second.write_number;
  const std::string slots[2] = {framed(encode(durable_marker)), framed(encode(second))};
  slot_bytes_ = kFirstSlotBytes;
  while (slot_bytes_ < slots[0].size() * 2) slot_bytes_ *= 2;
  for (const std::string& slot : slots) bytes.append(slot).append(slot_bytes_ - slot.size(), '\0');
  durable_marker.write_number = second.write_number;
  LOCUS_DCHECK_EQ(bytes.size(), 2 * slot_bytes_);
  LOCUS_DCHECK_EQ(durable_marker.write_number % 2, 1u);

  const std::string path = path_of(folder_);
  const std::string fresh = path + ".new";
  rocksdb::Status status = rocksdb::WriteStringToFile(&env_, bytes, fresh, true);
  if (status.ok()) status = env_.RenameFile(fresh, path);
  if (status.ok()) status = sync_folder(env_, folder_);
  if (status.ok()) status = env_.NewRandomRWFile(path, &file_, rocksdb::EnvOptions());
  return status.ok() ? absl::OkStatus() : error(folder_, status);
}

}  // namespace locus::server
