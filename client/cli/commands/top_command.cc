// `locus top`: rates and latencies of a server, computed from its metrics, as a table that is updated in place.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/extras/top/http_get.h"
#include "client/cli/extras/top/metrics_address.h"
#include "client/cli/extras/top/metrics_text.h"
#include "client/cli/extras/top/top_figures.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTimeout{5000};
// Escape sequence that moves the cursor to the upper left corner and clears the screen.
constexpr const char* kClearScreen = "\x1b[H\x1b[2J";

struct TopOptions {
  std::string address;  // empty = the server is asked
  double interval = 2;
  bool once = false;
  bool json = false;
};

struct Scraped {
  steady_clock::time_point at;
  std::vector<MetricSample> samples;
};

absl::StatusOr<Scraped> scrape(const TopOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const std::string text,
                   http_get(options.address, "/metrics", context.options().connection.credentials, kTimeout));
  ASSIGN_OR_RETURN(std::vector<MetricSample> samples, parse_metrics(text));
  return Scraped{steady_clock::now(), std::move(samples)};
}

// Guard that blocks SIGINT, SIGTERM and SIGHUP during its lifetime. These signals then make wait() return false, which
// ends the loop, instead of killing the program in the middle of a line.
class EndSignals {
 public:
  EndSignals() {
    sigemptyset(&ending_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ending_, signal);
    pthread_sigmask(SIG_BLOCK, &ending_, &before_);
  }
  ~EndSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;

  // Sleeps for `seconds`. Returns true after that time, or false as soon as one of the blocked signals arrives.
  bool wait(double seconds) const {
    const timespec time = {static_cast<time_t>(seconds), static_cast<long>((seconds - std::floor(seconds)) * 1e9)};
    return sigtimedwait(&ending_, nullptr, &time) < 0;
  }

 private:
  sigset_t ending_{};
  sigset_t before_{};
};

void write_tables(Context& context, const TopFigures& figures) {
  for (const auto& [name, rows] : {std::pair{"rpcs", &figures.rpcs}, std::pair{"queries", &figures.queries}}) {
    Report report;
    report.rows_name = name;
    report.rows = *rows;
    report.no_rows = "no calls";
    context.write(report);
    context.out() << "\n";
  }
  Report scenes;
  scenes.rows_name = "scenes";
  scenes.rows = figures.scenes;
  scenes.no_rows = "no scenes";
  context.write(scenes);
  context.out() << "\n";
  Report server;
  server.head = figures.server;
  context.write(server);
}

void write(Context& context, const TopFigures& figures) {
  if (context.options().format == Format::kTable) return write_tables(context, figures);
  Report report;
  report.head = {{"server", figures.server}, {"rpcs", figures.rpcs}, {"queries", figures.queries}};
  report.rows_name = "scenes";
  report.rows = figures.scenes;
  context.write(report);
}

absl::Status top(const TopOptions& given, Context& context) {
  RETURN_IF_ERROR(context.connection_mistake());
  if (given.json) context.options().format = Format::kJson;
  const bool live = !given.once && isatty(STDOUT_FILENO) == 1 && context.options().format == Format::kTable;
  const EndSignals end_signals;
  TopOptions options = given;
  if (options.address.empty()) {
    ASSIGN_OR_RETURN(client::Client* const client, context.connect());
    ASSIGN_OR_RETURN(const v1::GetServerResponse server, client->get_server());
    ASSIGN_OR_RETURN(options.address, metrics_address(context.address(), server));
  }
  ASSIGN_OR_RETURN(Scraped before, scrape(options, context));
  while (end_signals.wait(options.interval)) {
    ASSIGN_OR_RETURN(Scraped now, scrape(options, context));
    if (live) context.out() << kClearScreen;
    write(context, top_figures(before.samples, now.samples, std::chrono::duration<double>(now.at - before.at).count()));
    context.out().flush();
    if (options.once || !context.out()) break;
    before = std::move(now);
  }
  return absl::OkStatus();
}

}  // namespace

void add_top_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<TopOptions>();
  CLI::App& command = *parent.add_subcommand("top", "Show the load of a server from its metrics, updated periodically");
  command.footer(R"(Rates and quantiles are those of the last interval. Ctrl-C ends it, with exit code 0.

Examples:
  locus top
  locus top --metrics-address 10.0.0.7:7576 --ca ca.pem --token-file metrics.token
  locus top --once --json
  locus -o csv top --once --interval 10)");
  command
      .add_option("--metrics-address", options->address,
                  "locusd's HTTP port (its --http-listen): host:port [the server says it]")
      ->envname("LOCUS_METRICS_ADDRESS")
      ->type_name("ADDRESS");
  command.add_option("--interval", options->interval, "Seconds between two updates, 0.1 to 3600 [2]")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.1, 3600.0).description(""));
  command.add_flag("--once", options->once, "Show one interval and end");
  command.add_flag("--json", options->json, "The same as `-o json`");
  run_when_chosen(command, options, context, top);
}

}  // namespace locus::cli
