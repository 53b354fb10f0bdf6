#include "client/lib/query_batcher.h"

#include <utility>

#include "client/lib/gatherer.h"
#include "client/lib/query_builder.h"

namespace locus::client {
namespace {

// Queries of one message. In the message the rays are the first block and the balls the second; a block without queries
// is omitted.
struct Gathered {
  std::vector<SingleRay> rays;
  std::vector<SingleBall> balls;
  std::vector<QueryBatcher::HitCallback> on_hits;
  std::vector<QueryBatcher::IdsCallback> on_ids;
};

v1::QueryBatch message_of(const Gathered& gathered, const Double3& frame) {
  QueryBuilder builder;
  if (!gathered.rays.empty()) {
    RayBlock block = builder.rays();
    block.frame(frame);
    for (const SingleRay& ray : gathered.rays) block.ray(ray.origin, ray.direction, ray.t_max, ray.filter);
  }
  if (!gathered.balls.empty()) {
    BallBlock block = builder.balls();
    block.frame(frame);
    for (const SingleBall& ball : gathered.balls) block.ball(ball.center, ball.radius, ball.filter);
  }
  return builder.build();
}

void fail(const Gathered& gathered, const absl::Status& status) {
  for (const QueryBatcher::HitCallback& on_hit : gathered.on_hits) on_hit(status);
  for (const QueryBatcher::IdsCallback& on_ids : gathered.on_ids) on_ids(status);
}

// Calls the callback of each query with its part of `result`. If `result` does not match the queries, all callbacks get
// an error.
void deliver(const Gathered& gathered, const v1::QueryResult& result) {
  const int rays = gathered.rays.empty() ? 0 : 1, balls = gathered.balls.empty() ? 0 : 1;
  const absl::Status wrong = absl::DataLossError("the server's answer does not match the queries");
  if (result.blocks_size() != rays + balls) return fail(gathered, wrong);
  const v1::BlockResult none;
  const auto hits = RayHits::of(rays == 1 ? result.blocks(0) : none);
  const auto overlaps = Overlaps::of(balls == 1 ? result.blocks(rays) : none);
  if (!hits.ok() || !overlaps.ok() || hits->size() != gathered.rays.size() || overlaps->size() != gathered.balls.size())
    return fail(gathered, wrong);
  for (size_t i = 0; i < gathered.on_hits.size(); ++i)
    gathered.on_hits[i](SingleHit{hits->t(i), hits->id(i), hits->triangle(i)});
  for (size_t i = 0; i < gathered.on_ids.size(); ++i) {
    const absl::Span<const uint64_t> ids = overlaps->ids(i);
    gathered.on_ids[i](std::vector<uint64_t>(ids.begin(), ids.end()));
  }
}

}  // namespace

class QueryBatcher::Impl {
 public:
  Impl(std::unique_ptr<QueryStream> stream, const QueryBatcherOptions& options)
      : stream_(std::move(stream)),
        frame_(options.frame),
        gatherer_(options.limits, [this](Gathered gathered) { send(std::move(gathered)); }) {}

  Gatherer<Gathered>& gatherer() { return gatherer_; }
  void flush() {
    gatherer_.flush();
    stream_->flush().IgnoreError();  // each callback has received the stream's error
  }

 private:
  void send(Gathered gathered) {
    auto shared = std::make_shared<const Gathered>(std::move(gathered));
    const absl::Status sent =
        stream_->send(message_of(*shared, frame_), [shared](absl::StatusOr<v1::QueryResult> result) {
          if (result.ok())
            deliver(*shared, *result);
          else
            fail(*shared, result.status());
        });
    if (!sent.ok()) fail(*shared, sent);
  }

  const std::unique_ptr<QueryStream> stream_;
  const Double3 frame_;
  Gatherer<Gathered> gatherer_;  // declared last: its thread uses all members above
};

QueryBatcher::QueryBatcher(std::unique_ptr<QueryStream> stream, const QueryBatcherOptions& options)
    : impl_(std::make_unique<Impl>(std::move(stream), options)) {}

QueryBatcher::~QueryBatcher() { flush(); }

void QueryBatcher::ray(const SingleRay& ray, HitCallback on_hit) {
  impl_->gatherer().add([&](Gathered& gathered) {
    gathered.rays.push_back(ray);
    gathered.on_hits.push_back(std::move(on_hit));
  });
}

void QueryBatcher::ball(const SingleBall& ball, IdsCallback on_ids) {
  impl_->gatherer().add([&](Gathered& gathered) {
    gathered.balls.push_back(ball);
    gathered.on_ids.push_back(std::move(on_ids));
  });
}

void QueryBatcher::flush() { impl_->flush(); }

}  // namespace locus::client
