// The pages of the HTTP port: /metrics, with the counters and the host's current state; /healthz, which reports that
// the process is alive; /readyz, which reports whether calls are served.
//
// Threads: every member may be called from any thread; scrapes are serialised. A scrape calls Scene::status() for every
// scene. Without pinned old revisions this takes at most O(objects and instances).
#ifndef LOCUS_SERVER_SERVICES_SCRAPE_H_
#define LOCUS_SERVER_SERVICES_SCRAPE_H_

#include <atomic>
#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/config/observability_limits.h"
#include "server/host/host.h"
#include "server/observability/http_page.h"
#include "server/observability/scene_figures.h"

namespace locus::server {

class Scrape {
 public:
  // `host` must outlive the scrape.
  explicit Scrape(const Host& host) : host_(host) {}

  // Marks the server as ready. Connections to `addresses` are counted in the metric locus_connections_open.
  void serving(std::vector<std::string> addresses) LOCUS_EXCLUDES(mutex_);

  // Returns the pages, which refer to this object. With access control, /metrics needs the right `metrics`; the other
  // pages are for everybody.
  HttpPages pages();

  std::string metrics() LOCUS_EXCLUDES(mutex_);

 private:
  HttpReply readiness() const;
  HttpReply metrics_for(const HttpRequest& reader);

  const Host& host_;
  std::atomic<bool> serving_{false};
  Mutex mutex_;
  SceneLabels labels_ LOCUS_GUARDED_BY(mutex_) = SceneLabels(kMaxLabelledScenes);
  std::vector<std::string> addresses_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCRAPE_H_
