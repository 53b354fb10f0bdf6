// Writes the seeds that need an encoder into tests/fuzz/seeds: fuzz_write_seeds FOLDER. The same folders also contain
// seeds of text formats and inputs that once failed; this program does not change these other files.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>

#include "client/cli/levels/import/level_codec.h"
#include "core/scene/log/mesh_codec.h"
#include "core/scene/log/record_codec.h"
#include "core/scene/log/state_writer.h"
#include "core/scene/log/tree_codec.h"
#include "core/scene/scene.h"
#include "core/scene/spec_codec.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/update_service.pb.h"
#include "tests/client/cli/levels/import/quake/bsp_writer.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/columns.h"
#include "tests/support/random_updates.h"
#include "tests/support/raw_socket.h"

namespace locus::fuzz {
namespace {

class SeedWriter {
 public:
  explicit SeedWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void write(const std::string& target, const std::string& name, absl::string_view bytes) const {
    std::filesystem::create_directories(folder_ / target);
    std::ofstream file(folder_ / target / name, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    LOCUS_CHECK(file.good());
  }

 private:
  std::filesystem::path folder_;
};

std::shared_ptr<const StaticMesh> two_triangles() {
  auto mesh = TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 5, 5, 5}, {0, 1, 2, 1, 3, 2},
                                   {{"floor", 0}, {"wall", 1}});
  Sha256 sha256{};
  sha256[0] = 1;
  return *StaticMesh::build("mesh", sha256, *std::move(mesh));
}

PlacementColumns placement(test::Columns& columns) {
  PlacementColumns place;
  place.mesh = two_triangles();
  place.ids = columns.ids({100, 101});
  place.translations = columns.doubles({0, 0, 0, 5, 6, 7});
  place.groups = columns.ids({3});
  return place;
}

void write_records(const SeedWriter& seeds) {
  test::Columns columns;
  test::Random random(1);
  test::RandomUpdates updates(random, 20);
  for (int i = 0; i < 6; ++i) {
    UpdateBatch batch = updates.draw(columns, 4);
    if (!check_form(batch).ok()) continue;
    std::string bytes;
    encode_batch(batch, bytes);
    seeds.write("record", "batch_" + std::to_string(i), bytes);
  }
  MoveColumns move;
  move.ids = columns.ids({1, 2});
  move.positions = columns.floats({1, 2, 3, 4, 5, 6});
  UpdateBatch moves;
  moves.moves.push_back(move);
  std::string joined;
  encode_joined(std::vector<const UpdateBatch*>{&moves, &moves}, joined);
  seeds.write("record", "joined", joined);
  StaticChange change;
  change.place.push_back(placement(columns));
  change.remove_groups = columns.ids({9});
  std::string bytes;
  encode_change(change, change.place[0].ids, bytes);
  seeds.write("record", "change", bytes);
}

template <class Writer>
std::string chunks_of(Writer writer) {
  std::string input;
  while (std::optional<std::string> chunk = *writer.next()) append_piece(input, *chunk);
  return input;
}

void write_states(const SeedWriter& seeds) {
  test::Columns columns;
  test::Random random(2);
  test::RandomUpdates updates(random, 12);
  Scene scene("scene", SceneSpec(), 77, StaticSet::empty());
  seeds.write("state", "empty", chunks_of(StateWriter(scene.freeze())));
  for (int i = 0; i < 30; ++i) scene.apply(updates.draw(columns, 4)).IgnoreError();
  seeds.write("state", "objects", chunks_of(StateWriter(scene.freeze())));
  StaticChange change;
  change.place.push_back(placement(columns));
  LOCUS_CHECK(scene.change_instances(change).ok());
  seeds.write("state", "instances", chunks_of(StateWriter(scene.freeze())));
}

void write_meshes(const SeedWriter& seeds) {
  seeds.write("mesh", "two_triangles", chunks_of(MeshWriter(two_triangles())));
  seeds.write("mesh_parts", "two_parts", chunks_of(PartsWriter(two_triangles())));
  seeds.write("tree", "two_triangles", encode_topology(two_triangles()->tree().topology()));
  std::vector<Triangle> many;
  for (int i = 0; i < 64; ++i) {
    const auto x = static_cast<float>(i);
    many.push_back({{x, 0, 0}, {x + 0.5f, 0, 0}, {x, 1, 0}});
  }
  const TriangleBvh tree = *TriangleBvh::build(many);
  seeds.write("tree", "many_triangles", encode_topology(tree.topology()));
  SceneSpec spec;
  seeds.write("spec", "defaults", encode_spec(spec));
  spec.labels = {{"map", "delta"}, {"mode", "ctf"}};
  spec.history = {60, 1 << 20};
  seeds.write("spec", "labels", encode_spec(spec));
}

void add_shapes(v1::QueryBatch& batch) {
  v1::QueryBlock* rays = batch.add_blocks();
  for (float value : {0.f, 0.f, 100.f, 1.f, 2.f, 3.f}) rays->mutable_rays()->add_origins(value);
  for (float value : {0.f, 0.f, -1.f}) rays->mutable_rays()->add_directions(value);
  rays->mutable_rays()->set_mode(v1::RAY_MODE_ALL);
  rays->add_columns(v1::COLUMN_T);
  rays->add_as_of_ticks(2);
  v1::QueryBlock* balls = batch.add_blocks();
  for (float value : {0.f, 1.f, 0.f}) balls->mutable_balls()->add_centers(value);
  balls->mutable_balls()->add_radii(4);
  v1::QueryBlock* boxes = batch.add_blocks();
  for (float value : {0.f, 1.f, 0.f}) boxes->mutable_boxes()->add_centers(value);
  for (float value : {3.f, 3.f, 3.f}) boxes->mutable_boxes()->add_half_extents(value);
  for (float value : {0.f, 0.f, 0.f, 1.f}) boxes->mutable_boxes()->add_rotations(value);
  boxes->mutable_boxes()->set_detail(v1::STATIC_DETAIL_TRIANGLES);
}

void add_filters(v1::QueryBatch& batch) {
  v1::QueryBlock* rays = batch.add_blocks();
  for (float value : {0.f, 0.f, 100.f}) rays->mutable_rays()->add_origins(value);
  for (float value : {0.f, 0.f, -1.f, 0.f, 1.f, -1.f}) rays->mutable_rays()->add_directions(value);
  for (float value : {0.f, 0.6f, 0.f, 0.8f}) rays->add_rotation(value);
  rays->set_only_groups_each(2);
  for (uint64_t group : {3u, 0u, 0u, 0u}) rays->add_only_groups(group);
  rays->add_self_ids(1);
  v1::QueryBlock* boxes = batch.add_blocks();
  for (float value : {0.f, 1.f, 0.f}) boxes->mutable_boxes()->add_centers(value);
  for (float value : {3.f, 3.f, 3.f}) boxes->mutable_boxes()->add_half_extents(value);
  for (v1::Column column : {v1::COLUMN_T, v1::COLUMN_NORMAL, v1::COLUMN_POINT}) boxes->add_columns(column);
  boxes->add_tags(5);
  boxes->add_tag_masks(4);
}

void write_queries(const SeedWriter& seeds) {
  v1::QueryBatch batch;
  add_shapes(batch);
  seeds.write("queries", "shapes", batch.SerializeAsString());
  v1::QueryBatch filtered;
  add_filters(filtered);
  seeds.write("queries", "filters", filtered.SerializeAsString());
  v1::QueryBatch others;
  v1::QueryBlock* nearest = others.add_blocks();
  for (float value : {0.f, 1.f, 0.f}) nearest->mutable_nearest()->add_points(value);
  nearest->mutable_nearest()->set_k(3);
  nearest->add_masks(5);
  nearest->mutable_frame()->set_x(1e6);
  v1::QueryBlock* lookup = others.add_blocks();
  lookup->mutable_lookup()->add_ids(1);
  lookup->mutable_lookup()->add_ids(9);
  lookup->add_columns(v1::COLUMN_POSE);
  others.add_blocks()->mutable_lookup()->add_groups(3);
  seeds.write("queries", "nearest_and_lookup", others.SerializeAsString());
}

void write_instances(const SeedWriter& seeds) {
  v1::ChangeInstancesRequest two;
  v1::Placement* place = two.add_place();
  place->set_mesh("mesh");
  for (const uint64_t id : {100, 101}) place->add_ids(id);
  for (const double value : {0., 0., 0., 5., 6., 7.}) place->add_translations(value);
  for (const float value : {0.f, 0.f, 0.f, 1.f}) place->add_rotations(value);
  place->add_scales(2);
  place->add_groups(3);
  v1::ChangeInstancesRequest replace;
  replace.add_remove_ids(100);
  replace.add_remove_groups(3);
  place = replace.add_place();
  place->set_mesh("mesh");
  for (const double value : {1e6, 0., 3.}) place->add_translations(value);
  std::string input;
  append_piece(input, two.SerializeAsString());
  append_piece(input, replace.SerializeAsString());
  seeds.write("instances", "place_and_replace", input);
  place->set_mesh("unknown");
  input.clear();
  append_piece(input, replace.SerializeAsString());
  seeds.write("instances", "unknown_mesh", input);
}

void write_updates(const SeedWriter& seeds) {
  v1::UpdateBatch batch;
  v1::Insert* insert = batch.add_inserts();
  insert->add_ids(7);
  insert->add_ids(8);
  for (float value : {0.f, 0.f, 30.f, 1.f, 1.f, 1.f}) insert->add_positions(value);
  insert->mutable_ball()->add_radii(0.5);
  v1::Move* move = batch.add_moves();
  move->add_ids(7);
  for (double value : {1e6, 0., 3.}) move->add_positions_f64(value);
  v1::Relabel* relabel = batch.add_relabels();
  relabel->add_ids(8);
  relabel->add_groups(4);
  v1::InstanceMove* instance_move = batch.add_instance_moves();
  instance_move->add_ids(100);
  for (float value : {1.f, 2.f, 3.f}) instance_move->add_positions(value);
  instance_move->add_scales(2);
  v1::Relabel* hidden = batch.add_instance_relabels();
  hidden->add_ids(100);
  hidden->add_layers(0);
  batch.add_remove_ids(1);
  batch.set_tick(9);
  v1::UpdateBatch second;
  second.set_writer(5);
  second.set_batch(1);
  second.set_upsert(true);
  *second.add_inserts() = *insert;
  second.mutable_inserts(0)->mutable_box()->add_half_extents(1);
  std::string input;
  append_piece(input, batch.SerializeAsString());
  append_piece(input, second.SerializeAsString());
  seeds.write("updates", "two_batches", input);
  v1::SceneSpec spec;
  (*spec.mutable_labels())["map"] = "delta";
  spec.set_history_ticks(60);
  spec.set_winding(v1::WINDING_CLOCKWISE);
  seeds.write("scene_specs", "labels", spec.SerializeAsString());
  v1::CreateSceneRequest create;
  create.set_name("world");
  *create.mutable_spec() = spec;
  seeds.write("wire", "scene", create.SerializeAsString());
  v1::ApplyUpdatesRequest apply;
  apply.set_scene("world");
  *apply.mutable_batch() = batch;
  seeds.write("wire", "updates", apply.SerializeAsString());
  for (uint32_t label = 0; label <= limits::kMaxLabels; ++label)
    (*create.mutable_spec()->mutable_labels())[std::to_string(label)] = "x";
  seeds.write("wire", "too_many_labels", create.SerializeAsString());
  seeds.write("wire", "short_column", "\x3D\xA6\x3D\x08\x0A");  // one value of a repeated field
  seeds.write("wire", "unknown_field", "\x7A\x10" + std::string(16, 'x'));
}

// Writes seeds of HTTP/2 frames. The first byte of each seed is 2, so the target reads the frames in pieces of 3 bytes.
void write_frames(const SeedWriter& seeds) {
  const std::string begin = '\2' + test::kHttp2Opening;
  std::string endless = test::http2_frame(1, 0, 1, "headers");
  for (int frame = 0; frame < 20; ++frame) endless += test::http2_frame(9, 0, 1, "h");
  seeds.write("frames", "call", begin + test::http2_frame(1, 4, 1, "headers") + test::http2_frame(0, 1, 1, "data"));
  seeds.write("frames", "endless_headers", begin + endless);
}

void write_all(const SeedWriter& seeds) {
  write_records(seeds);
  write_states(seeds);
  write_meshes(seeds);
  write_queries(seeds);
  write_updates(seeds);
  write_instances(seeds);
  write_frames(seeds);
  seeds.write("bsp", "small_level", cli::small_level().bytes());
  cli::ImportedLevel level;
  level.source_format = "OBJ";
  level.notes = {"One note."};
  level.meshes.push_back(
      {"yard", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, {0, 1, 2, 1, 3, 2}, {{"floor", 0}, {"wall", 1}}});
  seeds.write("level_answer", "two_triangles", cli::encode_level(level));
  seeds.write("level_answer", "error", cli::encode_level(absl::NotFoundError("no such entry")));
}

}  // namespace
}  // namespace locus::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: fuzz_write_seeds FOLDER\n";
    return 2;
  }
  locus::fuzz::write_all(locus::fuzz::SeedWriter(argv[1]));
}
