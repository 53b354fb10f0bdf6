// The pages of the HTTP port: /metrics, put together from what was counted and from what the host holds at that moment,
// /healthz for whether the process is alive, and /readyz for whether calls are served.
//
// Threads: every member may be called from any thread; scrapes are made one at a time. A scrape asks every scene for
// its status, as GetScene does: O(objects).
#ifndef LOCUS_SERVER_SERVICES_SCRAPE_H_
#define LOCUS_SERVER_SERVICES_SCRAPE_H_

#include <atomic>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/config/observability_limits.h"
#include "server/host/host.h"
#include "server/observability/http_server.h"
#include "server/observability/scene_figures.h"

namespace locus::server {

class Scrape {
 public:
  // `host` must outlive it.
  explicit Scrape(const Host& host) : host_(host) {}

  // From here on calls are served, at `addresses`.
  void serving(std::vector<std::string> addresses) LOCUS_EXCLUDES(mutex_);

  // They refer to this scrape.
  HttpServer::Pages pages();

  std::string metrics() LOCUS_EXCLUDES(mutex_);

 private:
  HttpReply readiness() const;

  const Host& host_;
  std::atomic<bool> serving_{false};
  Mutex mutex_;
  SceneLabels labels_ LOCUS_GUARDED_BY(mutex_) = SceneLabels(kMaxLabelledScenes);
  std::vector<std::string> addresses_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCRAPE_H_
