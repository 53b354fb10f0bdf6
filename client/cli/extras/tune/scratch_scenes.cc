#include "client/cli/extras/tune/scratch_scenes.h"

#include <chrono>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Clock = std::chrono::steady_clock;

// Longer than a scene is left alone while others are built and measured.
constexpr uint32_t kIdleSeconds = 3600;
constexpr int kDeleteAttempts = 3;
// Values that a scene moves to other cells with each batch after its density was counted again.
constexpr uint64_t kRefiledPerBatch = 8192;

std::string random_prefix() {
  std::random_device device;
  return absl::StrFormat("tune-%08x%08x-", device(), device());
}

}  // namespace

ScratchScenes::ScratchScenes(const client::Client& work, const client::Client& cleaner, const v1::Scene& scene)
    : work_(work), cleaner_(cleaner), source_(scene), prefix_(random_prefix()) {}

ScratchScenes::~ScratchScenes() {
  for (int attempt = 0; attempt < kDeleteAttempts; ++attempt)
    for (const std::string& name : std::set<std::string>(names_)) remove(name).IgnoreError();  // a TTL deletes the rest
}

absl::StatusOr<ScratchScene> ScratchScenes::make(double cell_size, const ObjectBatches& objects) {
  v1::CreateSceneRequest request;
  request.set_name(absl::StrCat(prefix_, ++made_));
  v1::SceneSpec& spec = *request.mutable_spec();
  (*spec.mutable_labels())["made-by"] = "locus tune";
  (*spec.mutable_labels())["scratch-of"] = source_.name();
  spec.set_winding(source_.spec().winding());
  spec.set_durability(v1::DURABILITY_MEMORY);
  spec.set_idle_ttl_s(kIdleSeconds);
  spec.set_cell_size(cell_size);
  if (source_.instances() > 0) spec.set_static_from(source_.name());
  // A call that was cancelled may have made the scene nevertheless.
  names_.insert(request.name());
  const absl::StatusOr<v1::Scene> created = work_.create_scene(request);
  if (absl::IsAlreadyExists(created.status())) names_.erase(request.name());
  RETURN_IF_ERROR(created.status());
  ScratchScene scratch;
  scratch.name = request.name();
  RETURN_IF_ERROR(fill(request.name(), objects, scratch));
  ASSIGN_OR_RETURN(const v1::GetSceneResponse got, work_.describe_scene(request.name()));
  scratch.cell_size = got.description().objects().cell_size();
  if (scratch.cell_size <= 0) return absl::DataLossError("the server does not tell the cell size of a scene");
  scratch.bytes = got.description().objects().bytes();
  return scratch;
}

absl::Status ScratchScenes::fill(const std::string& name, const ObjectBatches& objects, ScratchScene& scratch) const {
  const Clock::time_point begin = Clock::now();
  for (const v1::UpdateBatch& batch : objects.batches()) {
    ASSIGN_OR_RETURN(const v1::UpdateAck ack, work_.apply(name, batch));
    RETURN_IF_ERROR(refused_items(ack));
  }
  scratch.build_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  // A scene that was filled by several batches may still have objects in cells of an earlier choice. Each batch that
  // changes something moves some of them, so an object is moved to and fro.
  const uint64_t more = objects.batches().size() < 2 ? 0 : 2 * (objects.objects() / kRefiledPerBatch / 2 + 1);
  for (uint64_t i = 0; i < more; ++i) {
    ASSIGN_OR_RETURN(const v1::UpdateAck ack, work_.apply(name, objects.move_first(i % 2 == 0)));
    RETURN_IF_ERROR(refused_items(ack));
  }
  return absl::OkStatus();
}

absl::Status ScratchScenes::remove(const std::string& name) {
  v1::DeleteSceneRequest request;
  request.set_name(name);
  const absl::Status deleted = cleaner_.delete_scene(request);
  if (!deleted.ok() && !absl::IsNotFound(deleted)) return deleted;
  names_.erase(name);
  return absl::OkStatus();
}

}  // namespace locus::cli
