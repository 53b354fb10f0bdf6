#include "tests/bench/serving/ending_cases.h"

#include <algorithm>
#include <thread>

#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/dynamic/world.h"
#include "tests/bench/serving/stream_load.h"
#include "tests/bench/serving/twin_scene.h"

namespace locus::bench::serving {
namespace {

constexpr uint32_t kObjects = 100'000;
constexpr double kMaxMs = 5;
constexpr double kSettled = 0.05;  // in seconds; settle() waits a tenth of this between two samples
constexpr const char* kDeadline = "deadline/1ms";
constexpr const char* kCancel = "cancel/1000";

// Makes a request of `balls` balls, each of which overlaps every object, so that the request takes long.
v1::QueryRequest long_job(const std::string& scene, int balls) {
  v1::QueryRequest request;
  request.set_scene(scene);
  v1::QueryBlock* const block = request.mutable_batch()->add_blocks();
  block->set_max_results(1);
  for (int i = 0; i < balls; ++i)
    for (const float value : {1000.0f, 1000.0f, static_cast<float>(i)}) block->mutable_balls()->add_centers(value);
  block->mutable_balls()->add_radii(5000);
  return request;
}

class EndingCases {
 public:
  EndingCases(const ServingRun& run, TwinScene& scene)
      : run_(run), scene_(scene), stub_(v1::QueryService::NewStub(scene.daemon().channel())) {}

  // Makes the job: doubles the number of balls until the server computes for more than a second (0.1 s in a quick run).
  absl::Status make_job() {
    const double wanted = run_.options.quick ? 0.1 : 1;
    for (int balls = 64; balls <= 65'536; balls *= 2) {
      job_ = long_job(scene_.name(), balls);
      const double before = computed();
      if (const grpc::Status whole = ask(60, nullptr); !whole.ok()) return absl::InternalError(whole.error_message());
      whole_ms_ = 1e3 * (computed() - before);
      if (whole_ms_ > 1e3 * wanted) break;
    }
    return absl::OkStatus();
  }

  void deadline() {
    if (!run_.wants(kDeadline)) return;
    run_.progress(kDeadline);
    std::vector<double> after;
    for (int i = 0; i < (run_.options.quick ? 5 : 50); ++i) {
      const double before = computed();
      const grpc::Status status = ask(0.001, nullptr);
      const double more = settle(before) - 1;
      if (is_ended(status, grpc::StatusCode::DEADLINE_EXCEEDED)) after.push_back(more);
    }
    add(kDeadline, after);
  }

  void cancel() {
    if (!run_.wants(kCancel)) return;
    run_.progress(kCancel);
    const Process& process = scene_.daemon().process();
    const int64_t files = process.open_files(), memory = process.resident_bytes();
    std::vector<double> after;
    for (int i = 0; i < (run_.options.quick ? 20 : 1000); ++i) {
      double at_cancel = 0;
      const auto give_up = [&](grpc::ClientContext& context) {
        sleep_seconds(0.002);
        at_cancel = computed();
        context.TryCancel();
      };
      const grpc::Status status = ask(60, give_up);
      const double more = settle(at_cancel);
      if (is_ended(status, grpc::StatusCode::CANCELLED)) after.push_back(more);
    }
    add(kCancel, after);
    run_.note(absl::StrFormat("%s: open files %d before and %d after, memory %.1f and %.1f MiB", kCancel, files,
                              process.open_files(), static_cast<double>(memory) / (1 << 20),
                              static_cast<double>(process.resident_bytes()) / (1 << 20)));
  }

 private:
  double computed() const { return scene_.daemon().process().cpu_seconds(); }

  template <class GiveUp>
  grpc::Status ask(double seconds, const GiveUp& give_up) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() +
                         std::chrono::microseconds(static_cast<int64_t>(1e6 * seconds)));
    v1::QueryResponse response;
    if constexpr (std::is_null_pointer_v<GiveUp>) {
      return stub_->Query(&context, job_, &response);
    } else {
      std::thread other([&] { give_up(context); });
      const grpc::Status status = stub_->Query(&context, job_, &response);
      other.join();
      return status;
    }
  }

  // Returns whether the call ended with `expected`. A refused call is counted but is not wrong: it means that the
  // server has not dropped the previous call yet. Stores any other status as wrong.
  bool is_ended(const grpc::Status& status, grpc::StatusCode expected) {
    if (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED)
      ++refused_;
    else if (status.error_code() != expected)
      wrong_.push_back(failed(status));
    return status.error_code() == expected;
  }

  // Waits until the server is idle. Returns the processor time in milliseconds that the server has used since
  // computed() returned `before`. Processor time does not depend on the machine's other load.
  double settle(double before) const {
    double last = computed();
    for (int i = 0; i < 200; ++i) {
      sleep_seconds(kSettled / 10);
      const double now = computed();
      if (now - last < kSettled / 500) break;
      last = now;
    }
    return 1e3 * (last - before);
  }

  void add(const std::string& name, const std::vector<double>& after) {
    constexpr double kMinMs = 0.01;
    if (!wrong_.empty())
      run_.disagree(absl::StrCat(name, ": ", wrong_.size(), " calls ended otherwise: ", wrong_.front().ToString()));
    if (refused_ != 0) run_.note(absl::StrCat(name, ": ", refused_, " calls were refused and do not count"));
    wrong_.clear();
    refused_ = 0;
    if (after.empty()) return;
    const double worst = std::max(kMinMs, percentile(after, 0.99));
    const std::vector<double> ours(1, worst), whole(1, whole_ms_);
    add_cell(run_, cell_of(name, "ms computed", hash_of_number(kObjects)), "whole_job", ours, whole, Better::kLess);
    const double most = *std::max_element(after.begin(), after.end());
    run_.note(absl::StrFormat(
        "%s: the server computes for another %.2f ms (p50), %.2f (p99), %.2f (most) of a job of "
        "%.0f, required 5: %s",
        name, percentile(after, 0.5), percentile(after, 0.99), most, whole_ms_, worst < kMaxMs ? "shown" : "MISSED"));
  }

  const ServingRun& run_;
  TwinScene& scene_;
  const std::unique_ptr<v1::QueryService::Stub> stub_;
  v1::QueryRequest job_;
  double whole_ms_ = 0;
  size_t refused_ = 0;
  std::vector<absl::Status> wrong_;
};

}  // namespace

bool wants_ending(const ServingRun& run) { return run.wants(kDeadline) || run.wants(kCancel); }

absl::Status run_ending_cases(const ServingRun& run) {
  if (!wants_ending(run)) return absl::OkStatus();
  const auto daemon = Daemon::start();
  if (!daemon.ok()) return daemon.status();
  TwinScene scene(**daemon, "ending");
  const dynamic::World world(dynamic::Kind::kUniform, kObjects);
  v1::UpdateBatch batch;
  v1::Insert* const insert = batch.add_inserts();
  insert->mutable_ids()->Add(world.objects().ids.begin(), world.objects().ids.end());
  insert->mutable_positions()->Add(world.objects().positions.begin(), world.objects().positions.end());
  insert->mutable_point();
  absl::Status status = scene.create();
  status.Update(scene.apply(batch));
  EndingCases cases(run, scene);
  if (status.ok()) status = cases.make_job();
  if (!status.ok()) return status;
  cases.deadline();
  cases.cancel();
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
