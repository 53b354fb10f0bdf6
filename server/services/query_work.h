// One query batch from message to columns: checks, the revision it asks for, its turn, the work, the answer. Nothing of
// it waits on the IO loop: for a revision that is to come it is parked, the work is set aside, and what takes long goes
// to the scheduler.
#ifndef LOCUS_SERVER_SERVICES_QUERY_WORK_H_
#define LOCUS_SERVER_SERVICES_QUERY_WORK_H_

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "core/query/query_batch.h"
#include "core/query/run/batch_run.h"
#include "core/scene/registry.h"
#include "locus/v1/query_service.pb.h"
#include "server/convert/result_columns.h"
#include "server/rpc/call_slot.h"
#include "server/rpc/io_threads.h"
#include "server/scheduling/query_scheduler.h"

namespace locus::server {

class QueryWork final : private QueryJob, private DeferredTask {
 public:
  explicit QueryWork(CallSlot& slot) : slot_(slot) {}

  // `batch` and `result` stay until the slot is answered.
  void begin(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result);
  // Ends a wait; ends work that waits for its turn, where the caller is gone. Work under way sees that by itself.
  void give_up();

 private:
  absl::Status read(const std::string& scene, const v1::QueryBatch& batch);
  void answer(absl::Status status);

  // Goes on with the revision that the view names, or waits for it.
  void look();
  void wait();
  // True: woken() will not come. False: it is on its way.
  bool end_wait();
  void woken(bool);
  absl::Status no_longer() const;

  void run();
  // Where it is short.
  void run_deferred() override;
  void on_deferred_done() override;
  // Otherwise.
  void submit(uint64_t nanoseconds);
  Progress work(uint64_t nanoseconds) override { return run_->work(nanoseconds); }
  void done() override;
  void finished(bool);
  void learn(const QueryBlock& block, const QueryCost& cost);
  void explain();
  void note_if_slow();

  CallSlot& slot_;
  const v1::QueryBatch* message_ = nullptr;
  v1::QueryResult* result_ = nullptr;
  ScenePtr scene_;
  View view_;
  QueryBatch batch_;
  SteadyTime until_;
  SteadyTime started_;  // its turn: after any wait for a revision

  // While waiting.
  std::optional<IoLoop::Timers::iterator> timer_;
  std::optional<Scene::Watch> watch_;
  std::atomic<bool> told_{false};  // woken() is on its way
  MemberTag<QueryWork> woken_{*this, &QueryWork::woken};

  std::optional<SnapshotPin> pin_;
  std::optional<ResultColumns> columns_;
  std::unique_ptr<BatchRun> run_;
  Progress progress_ = Progress::kMore;  // of the work set aside
  QueryScheduler::TicketPtr ticket_;
  MemberTag<QueryWork> finished_{*this, &QueryWork::finished};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUERY_WORK_H_
