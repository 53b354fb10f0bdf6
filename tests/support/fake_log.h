// A log that stores nothing. Its backups contain the files that a test has set. Used by tests of the code that handles
// a backup after the log has made it.
//
// Threads: back_up() may be called from any thread. A test sets the members before the server starts.
#ifndef LOCUS_TESTS_SUPPORT_FAKE_LOG_H_
#define LOCUS_TESTS_SUPPORT_FAKE_LOG_H_

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "core/scene/log/update_log.h"

namespace locus::test {

class FakeLog final : public UpdateLog {
 public:
  const std::vector<StoredScene>& stored_scenes() const override { return scenes_; }
  const std::vector<StoredMesh>& stored_meshes() const override { return meshes_; }
  absl::Status catalogue_damage() const override { return absl::OkStatus(); }
  bool closed_in_order() const override { return true; }

  absl::StatusOr<SceneKey> create_scene(absl::string_view, absl::string_view, uint64_t, ChunkSource) override {
    return ++last_key_;
  }
  absl::Status delete_scene(SceneKey) override { return absl::OkStatus(); }
  absl::Status restart_scene(SceneKey, uint64_t) override { return refusal(); }
  absl::Status set_scene_spec(SceneKey, absl::string_view) override { return refusal(); }
  absl::StatusOr<uint64_t> append(SceneKey, absl::Span<const LogEntry>, AckLevel) override { return refusal(); }
  absl::Status read(SceneKey, uint64_t, RecordSink) const override { return refusal(); }
  absl::StatusOr<uint64_t> latest(SceneKey) const override { return refusal(); }
  absl::Status write_snapshot(SceneKey, uint64_t, ChunkSource) override { return refusal(); }
  absl::Status read_snapshot(SceneKey, ChunkSink) const override { return refusal(); }
  absl::Status add_mesh(absl::string_view, const std::array<uint8_t, 32>&, ChunkSource, ChunkSource) override {
    return refusal();
  }
  absl::Status delete_mesh(absl::string_view) override { return refusal(); }
  absl::Status set_mesh_graces(absl::Span<const std::string>, uint32_t) override { return refusal(); }
  absl::Status read_mesh(const std::array<uint8_t, 32>&, ChunkSink) const override { return refusal(); }
  absl::Status read_parts(absl::string_view, ChunkSink) const override { return refusal(); }
  void store_topology(const std::array<uint8_t, 32>&, absl::string_view) override {}
  std::optional<std::string> read_topology(const std::array<uint8_t, 32>&) const override { return std::nullopt; }

  // Writes `files` below the new directory `path`, then calls `afterwards` if the test has set it.
  absl::Status back_up(const std::string& path) override {
    std::error_code why;
    if (!std::filesystem::create_directory(path, why)) return absl::UnavailableError("the directory is not new");
    for (const auto& [name, bytes] : files) {
      const std::filesystem::path file = std::filesystem::path(path) / name;
      std::filesystem::create_directories(file.parent_path(), why);
      std::ofstream(file, std::ios::binary) << bytes;
    }
    return afterwards ? afterwards(path) : absl::OkStatus();
  }

  std::map<std::string, std::string> files;  // content of each file of the backup, by path
  std::function<absl::Status(const std::string&)> afterwards;

 private:
  static absl::Status refusal() { return absl::UnimplementedError("a fake log keeps nothing"); }

  std::vector<StoredScene> scenes_;
  std::vector<StoredMesh> meshes_;
  SceneKey last_key_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_FAKE_LOG_H_
