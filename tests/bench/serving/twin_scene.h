// A pair of equal scenes: one in a server, and one in this process, where the same batches run without a network. Used
// by every case that compares the two. One thread fills the scenes; then any thread may read.
#ifndef LOCUS_TESTS_BENCH_SERVING_TWIN_SCENE_H_
#define LOCUS_TESTS_BENCH_SERVING_TWIN_SCENE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/query/query_batch.h"
#include "core/scene/scene.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/update_service.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/support/run_batch.h"

namespace locus::bench::serving {

class TwinScene {
 public:
  TwinScene(const Daemon& daemon, const std::string& name);

  // Creates the scene in the server; returns the error of the server.
  absl::Status create();
  absl::Status place(const BenchMesh& mesh);
  // Applies a batch to both scenes; also returns an error if an item is refused.
  absl::Status apply(const v1::UpdateBatch& batch);

  const std::string& name() const { return name_; }
  Scene& here() { return here_; }
  const Daemon& daemon() const { return daemon_; }

 private:
  const Daemon& daemon_;
  const std::string name_;
  Scene here_;
};

// Return the columns of a message. The message must outlive the columns. Only what the cases send is supported: queries
// of rays and balls; inserts of points and balls, and moves.
QueryBatch columns_of(const v1::QueryBatch& batch);
UpdateBatch columns_of(const v1::UpdateBatch& batch);

// Checks every value of a parsed batch and answers it as the server does, in the calling thread.
test::BatchResult answer_here(const SceneSnapshot& snapshot, const QueryBatch& batch);

// Returns a hash of an answer of this process, or of the server: equal if the answers are equal.
uint64_t hash_of(const test::BatchResult& result);
uint64_t hash_of(const v1::QueryResult& result);

// Returns the number of rows of a result: one for each ray, and one for each object in a ball.
size_t rows_of(const v1::QueryResult& result);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_TWIN_SCENE_H_
