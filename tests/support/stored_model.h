// Model of a log, for tests: it stores which operations the log acknowledged. When the log is opened again after a
// fault, the model checks that the log contains every acknowledged change and record, in order, and nothing that was
// never requested. One thread.
#ifndef LOCUS_TESTS_SUPPORT_STORED_MODEL_H_
#define LOCUS_TESTS_SUPPORT_STORED_MODEL_H_

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/scene/log/update_log.h"
#include "tests/support/random.h"
#include "tests/support/stored_log.h"

namespace locus::test {

// Policy for damage that the log reports: kNone treats it as a difference, kAllowed accepts it.
enum class Refusals : uint8_t { kNone, kAllowed };

class StoredModel {
 public:
  // Makes one random change of the log and stores the acknowledged result in the model.
  void step(UpdateLog& log, Random& random) {
    const uint64_t kind = random.below(100);
    if (scenes_.empty() || kind < 4) {
      create(log);
    } else if (kind < 6) {
      remove(log, random);
    } else if (kind < 12) {
      snapshot(log, random);
    } else if (kind < 15) {
      restart(log, random);
    } else if (kind < 22) {
      mesh(log, random);
    } else {
      append(log, random);
    }
  }

  // Returns a description of an element that is missing in the log or that the log must not contain; empty if there is
  // no such element.
  std::string difference(const UpdateLog& log, Refusals refusals) const {
    if (!log.catalogue_damage().ok() && refusals == Refusals::kNone)
      return std::string(log.catalogue_damage().message());
    for (const StoredScene& stored : log.stored_scenes()) {
      if (!stored.damage.ok() && refusals == Refusals::kNone) return std::string(stored.damage.message());
      const auto scene = scenes_.find(stored.name);
      if (stored.damage.ok() && (scene == scenes_.end() || scene->second.state == kGone))
        return absl::StrCat("scene ", stored.name, " is back");
    }
    for (const auto& [name, scene] : scenes_) {
      std::string what = scene_difference(log, name, scene, refusals);
      if (!what.empty()) return absl::StrCat("scene ", name, ": ", what);
    }
    return mesh_difference(log, refusals);
  }

  uint64_t acknowledged() const { return acknowledged_; }

 private:
  enum State : uint8_t { kThere, kGone, kUnknown };

  struct Scene {
    State state = kThere;
    SceneKey key = 0;
    uint64_t epoch = 7;
    uint64_t tried_epoch = 7;
    uint64_t last = 0;      // sequence number of the last record whose append to the disk was acknowledged
    uint64_t tried = 0;     // sequence number of the last record that was requested
    uint64_t snapshot = 0;  // sequence number of the last acknowledged snapshot
    uint64_t tried_snapshot = 0;
    uint64_t attempts = 0;
    // Attempts that the log may have stored, by the sequence number of the record: the last one that succeeded, and
    // later ones that failed.
    std::map<uint64_t, std::set<uint64_t>> tries;
  };
  // Returns the bytes of a record, which name the attempt to append it, so that a refused attempt that was stored
  // after all does not look like the later one.
  static std::string attempt_bytes(const Scene& scene, uint64_t sequence, uint64_t attempt) {
    return absl::StrCat("attempt ", attempt, ":", record_bytes(scene.key, sequence));
  }

  void create(UpdateLog& log) {
    const std::string name = absl::StrCat("s", next_name_++);
    Scene& scene = scenes_[name];
    ChunksFrom state(snapshot_chunks(next_name_, 0));
    const absl::StatusOr<SceneKey> key = log.create_scene(name, "spec", 7, state);
    scene.key = next_name_;  // determines the bytes of the scene's records
    keys_[name] = key.ok() ? *key : 0;
    scene.state = key.ok() ? kThere : kUnknown;
  }
  Scene* any(Random& random, std::string& name) {
    std::vector<std::string> names;
    for (const auto& [each, scene] : scenes_) {
      if (scene.state == kThere) names.push_back(each);
    }
    if (names.empty()) return nullptr;
    name = random.pick(names);
    return &scenes_[name];
  }
  void remove(UpdateLog& log, Random& random) {
    std::string name;
    Scene* scene = any(random, name);
    if (scene != nullptr) scene->state = log.delete_scene(keys_[name]).ok() ? kGone : kUnknown;
  }
  void restart(UpdateLog& log, Random& random) {
    std::string name;
    Scene* scene = any(random, name);
    if (scene == nullptr) return;
    ++scene->tried_epoch;
    if (log.restart_scene(keys_[name], scene->tried_epoch).ok()) {
      scene->epoch = scene->tried_epoch;
    } else {
      scene->state = kUnknown;  // it is unknown which of the two epochs the log has stored
    }
  }
  void snapshot(UpdateLog& log, Random& random) {
    std::string name;
    Scene* scene = any(random, name);
    if (scene == nullptr) return;
    const uint64_t at = scene->snapshot + random.below(scene->last - std::min(scene->snapshot, scene->last) + 1);
    if (at < scene->snapshot || at > log.latest(keys_[name]).value_or(0)) return;
    scene->tried_snapshot = std::max(scene->tried_snapshot, at);
    ChunksFrom state(snapshot_chunks(scene->key, at));
    if (log.write_snapshot(keys_[name], at, state).ok()) scene->snapshot = at;
  }
  void append(UpdateLog& log, Random& random) {
    std::string name;
    Scene* scene = any(random, name);
    if (scene == nullptr) return;
    const uint64_t before = log.latest(keys_[name]).value_or(0);
    const uint64_t count = 1 + random.below(3);
    const bool local = !random.chance(0.2);
    const uint64_t attempt = ++scene->attempts;
    std::vector<std::string> bytes;
    for (uint64_t i = 1; i <= count; ++i) bytes.push_back(attempt_bytes(*scene, before + i, attempt));
    std::vector<LogEntry> entries;
    for (uint64_t i = 1; i <= count; ++i) entries.push_back(entry_of(scene->epoch, before + i, bytes[i - 1]));
    scene->tried = std::max(scene->tried, before + count);
    const auto last = log.append(keys_[name], entries, local ? AckLevel::kLocal : AckLevel::kMemory);
    for (uint64_t i = 1; i <= count; ++i) {
      if (last.ok()) scene->tries[before + i].clear();
      scene->tries[before + i].insert(attempt);
    }
    if (!last.ok() || !local) return;
    scene->last = *last;
    acknowledged_ += count;
  }
  void mesh(UpdateLog& log, Random& random) {
    const std::string name = absl::StrCat("m", random.below(6));
    const auto found = meshes_.find(name);
    if (found == meshes_.end()) {
      const auto number = static_cast<uint8_t>(1 + random.below(3));
      ChunksFrom content({bytes_of(number, 400)});
      ChunksFrom parts({parts_of(name)});
      const bool known = log.add_mesh(name, hash_of(number), content, parts).ok();
      meshes_[name] = {number, known ? kThere : kUnknown};
      if (known) log.store_topology(hash_of(number), topology_bytes(number));
    } else if (found->second.second == kThere) {
      if (log.delete_mesh(name).ok()) {
        meshes_.erase(found);
      } else {
        found->second.second = kUnknown;
      }
    }
  }

  static std::string parts_of(const std::string& name) { return "parts of " + name; }
  static std::string topology_bytes(uint8_t number) { return bytes_of(100u + number, 60); }

  static std::string scene_difference(const UpdateLog& log, const std::string& name, const Scene& scene,
                                      Refusals refusals) {
    const StoredScene* stored = find_stored(log, name);
    if (stored == nullptr) return scene.state == kThere && log.catalogue_damage().ok() ? "is missing" : "";
    if (!stored->damage.ok()) return "";
    if (stored->epoch != scene.epoch && stored->epoch != scene.tried_epoch) return "another epoch";
    if (stored->snapshot_sequence < scene.snapshot) return "an older snapshot";
    if (stored->snapshot_sequence > std::max(scene.snapshot, scene.tried_snapshot)) return "a newer snapshot";
    const auto chunks = read_snapshot(log, stored->key);
    // The damage was detected by this read, which returned an error.
    if (absl::IsDataLoss(chunks.status()) && refusals == Refusals::kAllowed) return "";
    if (!chunks.ok()) return std::string(chunks.status().message());
    if (*chunks != snapshot_chunks(scene.key, stored->snapshot_sequence)) return "another snapshot";
    uint64_t last = stored->snapshot_sequence;
    std::string difference;
    const absl::Status read = log.read(stored->key, last + 1, [&](const LogRecord& record) {
      const auto tries = scene.tries.find(record.sequence);
      const bool tried =
          tries != scene.tries.end() && std::any_of(tries->second.begin(), tries->second.end(), [&](uint64_t attempt) {
            return record.entry.bytes == attempt_bytes(scene, record.sequence, attempt);
          });
      if (record.sequence != last + 1 || !tried) difference = absl::StrCat("record ", record.sequence, " is another");
      last = record.sequence;
      return absl::OkStatus();
    });
    if (absl::IsDataLoss(read) && refusals == Refusals::kAllowed) return "";
    if (!read.ok()) return std::string(read.message());
    if (last < scene.last) return absl::StrCat("has ", last, " of ", scene.last, " acknowledged records");
    if (last > std::max(scene.tried, scene.last)) return absl::StrCat("has ", last, " records of ", scene.tried);
    return difference;
  }

  std::string mesh_difference(const UpdateLog& log, Refusals refusals) const {
    std::map<std::string, const StoredMesh*> stored;
    for (const StoredMesh& mesh : log.stored_meshes()) {
      if (!mesh.damage.ok() && refusals == Refusals::kNone) return std::string(mesh.damage.message());
      // Verify no mesh after damage: a damaged catalogue may lack meshes, and its entries are not trusted.
      if (!mesh.damage.ok() || !log.catalogue_damage().ok()) return "";
      stored[mesh.name] = &mesh;
      const auto known = meshes_.find(mesh.name);
      if (known == meshes_.end()) return absl::StrCat("mesh ", mesh.name, " is back");
      if (mesh.sha256 != hash_of(known->second.first)) return absl::StrCat("mesh ", mesh.name, " is another");
      const auto chunks = read_mesh(log, mesh.sha256);
      const std::optional<std::string> topology = log.read_topology(mesh.sha256);
      if (topology && *topology != topology_bytes(known->second.first))
        return absl::StrCat("mesh ", mesh.name, " has another topology");
      if (absl::IsDataLoss(chunks.status()) && refusals == Refusals::kAllowed) continue;
      if (!chunks.ok()) return std::string(chunks.status().message());
      if (*chunks != std::vector<std::string>{bytes_of(known->second.first, 400)})
        return absl::StrCat("mesh ", mesh.name, " has other bytes");
      const auto parts = read_parts(log, mesh.name);
      if (absl::IsDataLoss(parts.status()) && refusals == Refusals::kAllowed) continue;
      if (!parts.ok()) return std::string(parts.status().message());
      if (*parts != std::vector<std::string>{parts_of(mesh.name)})
        return absl::StrCat("mesh ", mesh.name, " has other parts");
    }
    if (!log.catalogue_damage().ok())
      return refusals == Refusals::kAllowed ? "" : std::string(log.catalogue_damage().message());
    for (const auto& [name, mesh] : meshes_) {
      if (mesh.second == kThere && !stored.contains(name)) return absl::StrCat("mesh ", name, " is missing");
    }
    return "";
  }

  std::map<std::string, Scene> scenes_;
  std::map<std::string, SceneKey> keys_;
  std::map<std::string, std::pair<uint8_t, State>> meshes_;
  uint64_t next_name_ = 0;
  uint64_t acknowledged_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_STORED_MODEL_H_
