// Messages of the protocol as a client can send them: queries, updates, changes of instances and specifications of
// scenes. Accepted messages are within the limits, and a refusal names a field or a limit. Accepted update batches and
// changes are applied to a small scene.
// Accepted query batches of at most 256 queries are run on an unchanged small scene, and the results are compared with
// those of brute force.
#include <algorithm>

#include "core/base/limits.h"
#include "core/query/query_batch.h"
#include "core/scene/log/record_codec.h"
#include "core/scene/registry.h"
#include "core/scene/scene.h"
#include "core/scene/spec_codec.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/columns.h"
#include "tests/support/run_batch.h"

namespace locus::server {
namespace {

using fuzz::check_error;

// Verifies that a refusal names a field or, if it concerns a whole batch, a limit; and that it can be converted to the
// protocol's error.
void check_refusal(const absl::Status& status) {
  check_error(status);
  const std::optional<Refusal> refusal = refusal_of(status);
  LOCUS_CHECK(refusal.has_value());
  LOCUS_CHECK(refusal->reason != Reason::kUnspecified);
  LOCUS_CHECK(!refusal->field.empty() || !refusal->limit.empty());
  LOCUS_CHECK(to_error(status).message().size() <= 1024);
  LOCUS_CHECK(!to_grpc(status).ok());
}

// Returns a scene with a triangle and an object of each shape, with history.
std::unique_ptr<Scene> small_scene() {
  SceneSpec spec;
  spec.history = {8, limits::kDefaultHistoryBytes};
  auto scene = std::make_unique<Scene>("scene", spec, 7, StaticSet::empty());
  test::Columns columns;
  StaticChange change;
  auto mesh = TriangleMesh::create({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2}, {});
  PlacementColumns place;
  place.mesh = *StaticMesh::build("mesh", Sha256{}, *std::move(mesh));
  place.translations = columns.doubles({0, 0, -1});
  change.place.push_back(place);
  LOCUS_CHECK(scene->change_instances(change).ok());
  for (uint64_t tick = 1; tick <= 4; ++tick) {
    UpdateBatch batch;
    batch.tick = tick;
    batch.upsert = true;
    for (uint64_t kind = 0; kind < 4; ++kind) {
      InsertColumns insert;
      insert.ids = columns.ids({kind + 1});
      insert.kind = static_cast<ShapeKind>(kind);
      insert.positions = columns.floats({static_cast<float>(kind), static_cast<float>(tick), 0});
      if (insert.kind == ShapeKind::kBall || insert.kind == ShapeKind::kCapsule) insert.radii = columns.floats({0.5f});
      if (insert.kind == ShapeKind::kBox || insert.kind == ShapeKind::kCapsule)
        insert.extents = columns.floats({0.25f, 0.5f, 1});
      batch.inserts.push_back(insert);
    }
    LOCUS_CHECK(scene->apply(batch).ok());
  }
  return scene;
}

size_t queries_of(const QueryBatch& batch) {
  size_t total = 0;
  for (const QueryBlock& block : batch.blocks) total += query_count(block);
  return total;
}

LOCUS_FUZZ_TARGET(queries) {
  constexpr size_t kMaxRunQueries = 256;  // bounds the time of one input
  static const SnapshotPtr snapshot = small_scene()->latest();
  v1::QueryBatch message;
  if (!message.ParseFromArray(input.data(), static_cast<int>(input.size()))) return;
  const absl::StatusOr<QueryBatch> batch = to_queries(message);
  if (!batch.ok()) return check_refusal(batch.status());
  LOCUS_CHECK_LE(batch->blocks.size(), limits::kMaxBlocks);
  if (const absl::Status status = check_batch(*batch); !status.ok()) return check_refusal(status);
  LOCUS_CHECK_LE(queries_of(*batch), limits::kMaxQueries + limits::kMaxRays);
  if (queries_of(*batch) > kMaxRunQueries) return;
  const absl::StatusOr<test::BatchResult> found = test::run_batch(*snapshot, *batch, {});
  if (!found.ok()) return check_refusal(found.status());
  // Brute force does a different amount of work, so max_work would truncate its results at a different place.
  if (batch->max_work != 0) return;
  RunOptions all;
  all.brute_force = true;
  const absl::StatusOr<test::BatchResult> expected = test::run_batch(*snapshot, *batch, all);
  LOCUS_CHECK(expected.ok());
  for (size_t b = 0; b < found->blocks.size(); ++b) {
    LOCUS_CHECK(found->blocks[b].hits == expected->blocks[b].hits);
    LOCUS_CHECK(found->blocks[b].counts == expected->blocks[b].counts);
    LOCUS_CHECK(found->blocks[b].truncated == expected->blocks[b].truncated);
    LOCUS_CHECK(found->blocks[b].resolved_ticks == expected->blocks[b].resolved_ticks);
  }
}

LOCUS_FUZZ_TARGET(updates) {
  constexpr size_t kMaxPieces = 4;
  const std::unique_ptr<Scene> scene = small_scene();
  for (size_t i = 0; i < kMaxPieces && !input.empty(); ++i) {
    const absl::string_view piece = fuzz::next_piece(input);
    v1::UpdateBatch message;
    if (!message.ParseFromArray(piece.data(), static_cast<int>(piece.size()))) continue;
    const absl::StatusOr<UpdateBatch> batch = to_updates(message);
    if (!batch.ok()) {
      check_refusal(batch.status());
      continue;
    }
    if (const absl::Status form = check_form(*batch); !form.ok()) {
      check_refusal(form);
      LOCUS_CHECK(!scene->apply(*batch).ok());
      continue;
    }
    std::string bytes;
    encode_batch(*batch, bytes);
    LOCUS_CHECK(Record::decode(bytes).ok());
    const absl::StatusOr<UpdateAck> ack = scene->apply(*batch);
    if (!ack.ok()) {
      check_refusal(ack.status());
      continue;
    }
    LOCUS_CHECK_LE(ack->errors.size(), ack->refused);
    LOCUS_CHECK_EQ(to_proto(*ack).errors_size(), static_cast<int>(ack->errors.size()));
    scene->latest()->objects.for_each([](const Object& object) {
      LOCUS_CHECK(object.id != kNoId);
      for (int axis = 0; axis < 3; ++axis)
        LOCUS_CHECK(std::abs(object.shape.position[axis]) <= 2 * limits::kMaxCoordinate);
    });
  }
}

// Applies up to four changes to a scene. The registry knows one mesh, `mesh`.
LOCUS_FUZZ_TARGET(instances) {
  constexpr size_t kMaxPieces = 4;
  Registry registry;
  auto triangle = TriangleMesh::create({0, 0, 0, 9, 0, 0, 0, 9, 0}, {0, 1, 2}, {});
  LOCUS_CHECK(registry.add_mesh("mesh", *StaticMesh::build("mesh", Sha256{}, *std::move(triangle))).ok());
  const std::unique_ptr<Scene> scene = small_scene();
  for (size_t i = 0; i < kMaxPieces && !input.empty(); ++i) {
    const absl::string_view piece = fuzz::next_piece(input);
    v1::ChangeInstancesRequest message;
    if (!message.ParseFromArray(piece.data(), static_cast<int>(piece.size()))) continue;
    const absl::StatusOr<StaticChange> change = to_change(message, registry);
    if (!change.ok()) {
      check_refusal(change.status());
      continue;
    }
    const SnapshotPtr before = scene->latest();
    const absl::StatusOr<InstanceChange> done = scene->change_instances(*change);
    const SnapshotPtr after = scene->latest();
    if (!done.ok()) {
      check_refusal(done.status());
      LOCUS_CHECK(after == before);
      continue;
    }
    LOCUS_CHECK_LE(after->statics->size(), limits::kMaxInstances);
    for (const uint64_t id : change->remove_ids)
      LOCUS_CHECK(after->statics->find(id) == nullptr || std::ranges::count(done->placed, id) == 1);
    for (const Id id : done->placed) {
      const Instance* placed = after->statics->find(id);
      LOCUS_CHECK(placed != nullptr);
      for (int axis = 0; axis < 3; ++axis) {
        LOCUS_CHECK_LE(placed->bounds.min[axis], placed->bounds.max[axis]);
        LOCUS_CHECK(std::isfinite(placed->bounds.min[axis]) && std::isfinite(placed->bounds.max[axis]));
      }
    }
  }
}

LOCUS_FUZZ_TARGET(scene_specs) {
  v1::SceneSpec message;
  if (!message.ParseFromArray(input.data(), static_cast<int>(input.size()))) return;
  const absl::StatusOr<SceneSpec> spec = to_spec(message);
  if (!spec.ok()) return check_refusal(spec.status());
  LOCUS_CHECK_LE(spec->history.ticks, limits::kMaxHistoryTicks);
  LOCUS_CHECK_LE(spec->history.bytes, limits::kMaxHistoryBytes);
  const absl::StatusOr<SceneSpec> again = decode_spec(encode_spec(*spec));
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(again->labels == spec->labels && again->history.ticks == spec->history.ticks);
}

}  // namespace
}  // namespace locus::server
