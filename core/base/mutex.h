// std::mutex and std::condition_variable with Clang's thread-safety annotations. All locks of the core and of the
// daemon are of these types: ThreadSanitizer reports false races for Debian's absl::Mutex, but none for std::mutex.
#ifndef LOCUS_CORE_BASE_MUTEX_H_
#define LOCUS_CORE_BASE_MUTEX_H_

#include <chrono>
#include <condition_variable>
#include <mutex>

#if defined(__clang__)
#define LOCUS_THREAD_ANNOTATION(x) __attribute__((x))
#else
#define LOCUS_THREAD_ANNOTATION(x)
#endif
#define LOCUS_CAPABILITY(x) LOCUS_THREAD_ANNOTATION(capability(x))
#define LOCUS_SCOPED_CAPABILITY LOCUS_THREAD_ANNOTATION(scoped_lockable)
#define LOCUS_GUARDED_BY(x) LOCUS_THREAD_ANNOTATION(guarded_by(x))
#define LOCUS_REQUIRES(...) LOCUS_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define LOCUS_ACQUIRE(...) LOCUS_THREAD_ANNOTATION(acquire_capability(__VA_ARGS__))
#define LOCUS_RELEASE(...) LOCUS_THREAD_ANNOTATION(release_capability(__VA_ARGS__))
#define LOCUS_EXCLUDES(...) LOCUS_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))

namespace locus {

class LOCUS_CAPABILITY("mutex") Mutex {
 public:
  void lock() LOCUS_ACQUIRE() { mutex_.lock(); }
  void unlock() LOCUS_RELEASE() { mutex_.unlock(); }

 private:
  std::mutex mutex_;
};

class LOCUS_SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) LOCUS_ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  ~MutexLock() LOCUS_RELEASE() { mutex_.unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

// Condition variable for Mutex. The caller of wait() or wait_until() must hold the mutex through a MutexLock; the call
// releases the mutex while it waits and acquires the mutex again before it returns. Wake-ups may be spurious: wait in a
// loop.
class ConditionVariable {
 public:
  void wait(Mutex& mutex) LOCUS_REQUIRES(mutex) { condition_.wait(mutex); }
  // Waits until a notification or `deadline`. Returns false if the deadline has passed.
  bool wait_until(Mutex& mutex, std::chrono::steady_clock::time_point deadline) LOCUS_REQUIRES(mutex) {
    return condition_.wait_until(mutex, deadline) == std::cv_status::no_timeout;
  }
  void notify_all() { condition_.notify_all(); }
  void notify_one() { condition_.notify_one(); }

 private:
  std::condition_variable_any condition_;
};

}  // namespace locus

#endif  // LOCUS_CORE_BASE_MUTEX_H_
