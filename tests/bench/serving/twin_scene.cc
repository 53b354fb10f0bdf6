#include "tests/bench/serving/twin_scene.h"

#include <bit>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/mesh/triangle_mesh.h"
#include "tests/bench/frame/results_hash.h"

namespace locus::bench::serving {
namespace {

constexpr uint64_t kInstance = 1;
constexpr uint64_t kEpoch = 1;

template <class Repeated>
auto span_of(const Repeated& column) {
  return absl::MakeConstSpan(column.data(), static_cast<size_t>(column.size()));
}

ColumnSet columns_asked(const v1::QueryBlock& block) {
  ColumnSet columns;
  for (const int column : block.columns()) columns.add(static_cast<Column>(column));
  return columns;
}

QueryBlock columns_of(const v1::QueryBlock& block) {
  QueryBlock columns;
  columns.columns = columns_asked(block);
  columns.masks = span_of(block.masks());
  columns.max_results = block.max_results();
  if (block.has_rays()) {
    RayColumns rays;
    rays.origins = span_of(block.rays().origins());
    rays.directions = span_of(block.rays().directions());
    rays.t_max = span_of(block.rays().t_max());
    columns.kind = rays;
  } else {
    BallColumns balls;
    balls.centers = span_of(block.balls().centers());
    balls.radii = span_of(block.balls().radii());
    columns.kind = balls;
  }
  return columns;
}

template <class Column>
void add_floats(const Column& column, ResultsHash& hash) {
  for (const float value : column) hash.add(std::bit_cast<uint32_t>(value));
}

template <class Column>
void add_numbers(const Column& column, ResultsHash& hash) {
  for (const auto value : column) hash.add(value);
}

class AnswerHash {
 public:
  template <class Floats, class Ids, class Numbers>
  void add(const Floats& t, const Floats& uvs, const Ids& ids, const Numbers& triangles, const Numbers& counts) {
    add_floats(t, hash_);
    add_floats(uvs, hash_);
    add_numbers(ids, hash_);
    add_numbers(triangles, hash_);
    add_numbers(counts, hash_);
  }
  uint64_t value() const { return hash_.value(); }

 private:
  ResultsHash hash_;
};

}  // namespace

TwinScene::TwinScene(const Daemon& daemon, const std::string& name)
    : daemon_(daemon), name_(name), here_(name, SceneSpec(), kEpoch, StaticSet::empty()) {}

absl::Status TwinScene::create() {
  v1::CreateSceneRequest request;
  request.set_name(name_);
  return daemon_.client().create_scene(request).status();
}

absl::Status TwinScene::place(const BenchMesh& mesh) {
  const auto uploaded = daemon_.client().upload_mesh({mesh.name, mesh.vertices, mesh.indices});
  if (!uploaded.ok()) return uploaded.status();
  v1::ChangeInstancesRequest request;
  request.set_scene(name_);
  v1::Placement* const placement = request.add_place();
  placement->set_mesh(mesh.name);
  placement->add_ids(kInstance);
  for (int axis = 0; axis < 3; ++axis) placement->add_translations(0);
  if (const auto changed = daemon_.client().change_instances(request); !changed.ok()) return changed.status();
  absl::StatusOr<TriangleMesh> triangles = TriangleMesh::create(mesh.vertices, mesh.indices, {});
  if (!triangles.ok()) return triangles.status();
  auto built = StaticMesh::build(mesh.name, {}, *std::move(triangles));
  if (!built.ok()) return built.status();
  constexpr double kOrigin[] = {0, 0, 0};
  PlacementColumns columns;
  columns.mesh = *std::move(built);
  columns.ids = absl::MakeConstSpan(&kInstance, 1);
  columns.translations = kOrigin;
  StaticChange change;
  change.place.push_back(std::move(columns));
  return here_.change_instances(change).status();
}

absl::Status TwinScene::apply(const v1::UpdateBatch& batch) {
  const auto there = daemon_.client().apply(name_, batch);
  if (!there.ok()) return there.status();
  const auto here = here_.apply(columns_of(batch));
  if (!here.ok()) return here.status();
  if (there->refused() != 0 || here->refused != 0 || there->applied() != here->applied)
    return absl::DataLossError(absl::StrCat("of a batch ", there->applied(), " items were applied by the server and ",
                                            here->applied, " in process"));
  return absl::OkStatus();
}

QueryBatch columns_of(const v1::QueryBatch& batch) {
  QueryBatch columns;
  for (const v1::QueryBlock& block : batch.blocks()) columns.blocks.push_back(columns_of(block));
  columns.max_reply_bytes = batch.max_reply_bytes();
  return columns;
}

UpdateBatch columns_of(const v1::UpdateBatch& batch) {
  UpdateBatch columns;
  for (const v1::Insert& insert : batch.inserts()) {
    InsertColumns& inserts = columns.inserts.emplace_back();
    inserts.ids = span_of(insert.ids());
    inserts.positions = span_of(insert.positions());
    if (insert.has_ball()) inserts.kind = ShapeKind::kBall;
    if (insert.has_ball()) inserts.radii = span_of(insert.ball().radii());
  }
  for (const v1::Move& move : batch.moves()) {
    MoveColumns& moves = columns.moves.emplace_back();
    moves.ids = span_of(move.ids());
    moves.positions = span_of(move.positions());
  }
  return columns;
}

test::BatchResult answer_here(const SceneSnapshot& snapshot, const QueryBatch& batch) {
  LOCUS_CHECK(check_batch(batch).ok());
  absl::StatusOr<test::BatchResult> answer = test::run_batch(snapshot, batch, {});
  LOCUS_CHECK(answer.ok());
  return *std::move(answer);
}

uint64_t hash_of(const test::BatchResult& result) {
  AnswerHash hash;
  for (const test::BlockResult& block : result.blocks)
    hash.add(block.t, block.uvs, block.ids, block.triangles, block.counts);
  return hash.value();
}

uint64_t hash_of(const v1::QueryResult& result) {
  AnswerHash hash;
  for (const v1::BlockResult& block : result.blocks())
    hash.add(block.t(), block.uvs(), block.ids(), block.triangles(), block.counts());
  return hash.value();
}

size_t rows_of(const v1::QueryResult& result) {
  size_t rows = 0;
  for (const v1::BlockResult& block : result.blocks()) rows += static_cast<size_t>(block.ids_size());
  return rows;
}

}  // namespace locus::bench::serving
