#include "tests/bench/serving/tls_cases.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "tests/bench/serving/certificates.h"
#include "tests/bench/serving/good_client.h"
#include "tests/bench/serving/newcomers.h"
#include "tests/bench/serving/processor_time.h"
#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {
namespace {

constexpr const char* kBulk = "tls/8192";
constexpr const char* kSmall = "tls/16";
constexpr const char* kHandshake = "tls/handshake";
constexpr const char* kMutualHandshake = "tls/mutual_handshake";

// A daemon with the level, reached over one kind of transport.
class TlsHost {
 public:
  static absl::StatusOr<std::unique_ptr<TlsHost>> start(const Certificates& certificates, Transport transport,
                                                        const BenchMesh& mesh) {
    std::vector<std::string> options = certificates.daemon_options(transport);
    options.push_back(kManyNewConnections);
    ASSIGN_OR_RETURN(auto daemon, Daemon::start(options, certificates.client_options(transport)));
    auto host = std::unique_ptr<TlsHost>(new TlsHost(std::move(daemon)));
    RETURN_IF_ERROR(host->scene_.create());
    RETURN_IF_ERROR(host->scene_.place(mesh));
    return host;
  }

  const Daemon& daemon() const { return *daemon_; }
  TwinScene& scene() { return scene_; }

 private:
  explicit TlsHost(std::unique_ptr<Daemon> daemon) : daemon_(std::move(daemon)), scene_(*daemon_, "tls") {}

  const std::unique_ptr<Daemon> daemon_;
  TwinScene scene_;
};

class TlsCases {
 public:
  TlsCases(const ServingRun& run, const BenchMesh& mesh, TlsHost& plain, TlsHost& tls)
      : run_(run), mesh_(mesh), plain_(plain), tls_(tls) {}

  // Measures neighbouring rays. They are cheap to compute, so that the cost of their messages shows most.
  absl::Status bulk() {
    if (!run_.wants(kBulk)) return absl::OkStatus();
    run_.progress(kBulk);
    constexpr size_t kRays = 8192, kTlsStreams = 2, kTlsWindow = 2;
    Batches batches = batches_of(coherent_rays(mesh_, run_.options.quick ? 65'536 : 524'288), kRays, name());
    ServerLoad tls(tls_.daemon(), batches, kTlsStreams, kTlsWindow);
    ServerLoad plain(plain_.daemon(), batches, kTlsStreams, kTlsWindow);
    const std::vector<uint64_t> here = LocalLoad(plain_.scene().here().latest(), batches, 1).hashes();
    check_answers(run_, kBulk, tls.hashes(), here);
    check_answers(run_, kBulk, plain.hashes(), here);
    const size_t chunks = run_.options.quick ? 1 : 8;
    const auto count = static_cast<double>(batches.queries) * static_cast<double>(chunks);
    const std::vector<Contestant> contestants = {{"tls", [&](size_t) { tls.run(1); }, count, {}},
                                                 {"plain", [&](size_t) { plain.run(1); }, count, {}}};
    add_cells(contestants, race(contestants, chunks, run_.options.rounds, wall_seconds),
              cell_of(kBulk, "ns/ray", hash_of_numbers(here)), run_.report);
    constexpr double kBar = 0.5;
    note_bar(run_.report, kBar);
    absl::Status status = tls.status();
    status.Update(plain.status());
    return status;
  }

  // Measures the time of small batches, sent one after another.
  absl::Status small() {
    if (!run_.wants(kSmall)) return absl::OkStatus();
    run_.progress(kSmall);
    GoodClient tls(run_, tls_.scene(), kSmall, small_batches());
    GoodClient plain(run_, plain_.scene(), kSmall, small_batches());
    const size_t count = run_.options.quick ? 300 : 1000, chunks = run_.options.quick ? 1 : 8;
    std::vector<double> times;
    const auto all = static_cast<double>(count * chunks);
    const std::vector<Contestant> contestants = {{"tls", [&](size_t) { tls.ask(count, times); }, all, {}},
                                                 {"plain", [&](size_t) { plain.ask(count, times); }, all, {}}};
    add_cells(contestants, race(contestants, chunks, run_.options.rounds, wall_seconds),
              cell_of(kSmall, "ns/batch", hash_of_numbers(plain.expected())), run_.report);
    constexpr double kBar = 0.75;
    note_bar(run_.report, kBar);
    absl::Status status = tls.status();
    status.Update(plain.status());
    return status;
  }

  // Measures, as the case `case_name`, new connections to two daemons: `guarded`, which has TLS and may require
  // certificates of its clients, and the plain daemon.
  absl::Status handshakes(const std::string& case_name, TlsHost& guarded) {
    if (!run_.wants(case_name)) return absl::OkStatus();
    run_.progress(case_name);
    const Batches batches = small_batches();
    Newcomers tls(guarded.daemon(), batches), plain(plain_.daemon(), batches);
    const std::vector<uint64_t> here = LocalLoad(plain_.scene().here().latest(), batches, 1).hashes();
    check_answers(run_, case_name, tls.hashes(), here);
    check_answers(run_, case_name, plain.hashes(), here);
    const size_t count = run_.options.quick ? 40 : 500;
    ProcessorTime tls_time(guarded.daemon().process().pid()), plain_time(plain_.daemon().process().pid());
    std::vector<double> with, without;
    for (int round = 0; round <= run_.options.rounds; ++round) {
      const double start = wall_seconds();
      tls_time.during(count, [&] { tls.run(count); });
      const double middle = wall_seconds();
      plain_time.during(count, [&] { plain.run(count); });
      if (round == 0) continue;
      with.push_back(static_cast<double>(count) / (middle - start));
      without.push_back(static_cast<double>(count) / (wall_seconds() - middle));
    }
    add_cell(run_, cell_of(case_name, "connections/s", hash_of_numbers(here)), "plain", with, without, Better::kMore);
    run_.note(absl::StrFormat("%s: processor time a connection: %s; in plain: %s", case_name, tls_time.text(),
                              plain_time.text()));
    absl::Status status = tls.status();
    status.Update(plain.status());
    return status;
  }

 private:
  const std::string& name() const { return plain_.scene().name(); }
  Batches small_batches() {
    constexpr size_t kRays = GoodClient::kRays, kBatches = 64;
    return batches_of(scattered_rays(mesh_, kBatches * kRays), kRays, name());
  }

  const ServingRun& run_;
  const BenchMesh& mesh_;
  TlsHost& plain_;
  TlsHost& tls_;
};

}  // namespace

absl::Status run_tls_cases(const ServingRun& run) {
  const std::vector<std::string> names = {kBulk, kSmall, kHandshake, kMutualHandshake};
  if (std::none_of(names.begin(), names.end(), [&](const std::string& name) { return run.wants(name); }))
    return absl::OkStatus();
  ASSIGN_OR_RETURN(const BenchMesh mesh, level_of(run));
  ASSIGN_OR_RETURN(const auto certificates, Certificates::make());
  ASSIGN_OR_RETURN(const auto plain, TlsHost::start(*certificates, Transport::kPlain, mesh));
  ASSIGN_OR_RETURN(const auto tls, TlsHost::start(*certificates, Transport::kTls, mesh));
  TlsCases cases(run, mesh, *plain, *tls);
  RETURN_IF_ERROR(cases.bulk());
  RETURN_IF_ERROR(cases.small());
  RETURN_IF_ERROR(cases.handshakes(kHandshake, *tls));
  if (!run.wants(kMutualHandshake)) return absl::OkStatus();
  ASSIGN_OR_RETURN(const auto mutual, TlsHost::start(*certificates, Transport::kMutualTls, mesh));
  return cases.handshakes(kMutualHandshake, *mutual);
}

}  // namespace locus::bench::serving
