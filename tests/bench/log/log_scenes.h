// Empty scenes of a log, to which a benchmark appends records. Threads: any thread, but one at a time for each scene.
#ifndef LOCUS_TESTS_BENCH_LOG_LOG_SCENES_H_
#define LOCUS_TESTS_BENCH_LOG_LOG_SCENES_H_

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/scene/log/update_log.h"

namespace locus::bench::log {

class LogScenes {
 public:
  // Creates `count` scenes whose names begin with `prefix`.
  static absl::StatusOr<LogScenes> create(std::unique_ptr<UpdateLog> log, const std::string& prefix, size_t count) {
    LogScenes scenes;
    scenes.log_ = std::move(log);
    for (size_t i = 0; i < count; ++i) {
      const auto nothing = []() -> absl::StatusOr<std::optional<std::string>> { return std::nullopt; };
      const auto key = scenes.log_->create_scene(absl::StrCat(prefix, "-", i), "", kEpoch, nothing);
      if (!key.ok()) return key.status();
      scenes.keys_.push_back(*key);
    }
    return scenes;
  }

  // Appends one record; returns when it is synced.
  absl::Status append(size_t scene, const std::string& record) const {
    LogEntry entry;
    entry.epoch = kEpoch;
    entry.bytes = record;
    return log_->append(keys_[scene], {&entry, 1}, AckLevel::kLocal).status();
  }

  // Returns the bytes of all records of a scene, in order.
  absl::StatusOr<std::string> read_all(size_t scene) const {
    std::string all;
    const auto sink = [&all](const LogRecord& record) {
      absl::StrAppend(&all, record.entry.bytes);
      return absl::OkStatus();
    };
    if (absl::Status status = log_->read(keys_[scene], 1, sink); !status.ok()) return status;
    return all;
  }

 private:
  static constexpr uint64_t kEpoch = 1;

  LogScenes() = default;

  std::unique_ptr<UpdateLog> log_;
  std::vector<SceneKey> keys_;
};

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_LOG_SCENES_H_
