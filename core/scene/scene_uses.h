// Record of the calls and streams that use a scene, from which the server decides whether the scene is idle: see
// SceneSpec::idle_ttl_s. Times are nanoseconds since any start; the caller passes them, because this folder reads no
// clock.
//
// Threads: any thread may call every member. No member takes a lock. A use that ends happens before an idle_since()
// that does not count it any more, so that idle_since() never returns a time before the end of that use.
#ifndef LOCUS_CORE_SCENE_SCENE_USES_H_
#define LOCUS_CORE_SCENE_SCENE_USES_H_

#include <atomic>
#include <cstdint>
#include <optional>

namespace locus {

class SceneUses {
 public:
  // Counts a use that begins. end() must follow.
  void begin() { running_.fetch_add(1, std::memory_order_relaxed); }
  // Counts a use that ends at `now`.
  void end(uint64_t now) {
    touch(now);
    running_.fetch_sub(1, std::memory_order_release);
  }
  // Records a use that begins and ends at `now`.
  void touch(uint64_t now) { last_.store(now, std::memory_order_relaxed); }
  // Returns the end of the last use, or nullopt while a use has not ended.
  std::optional<uint64_t> idle_since() const {
    if (running_.load(std::memory_order_acquire) != 0) return std::nullopt;
    return last_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<uint32_t> running_{0};
  std::atomic<uint64_t> last_{0};
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_USES_H_
