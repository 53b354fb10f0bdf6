// The program `locus-bench`: runs one suite of benchmarks, which compare locus with peers, and writes the results as a
// table and as JSON.
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/progress_writer.h"
#include "core/base/status_macros.h"
#include "tests/bench/cluster/cluster_suite.h"
#include "tests/bench/dynamic/dynamic_suite.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/report.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/log/log_suite.h"
#include "tests/bench/plot/drawing.h"
#include "tests/bench/plot/record.h"
#include "tests/bench/queries/queries_suite.h"
#include "tests/bench/serving/serving_suite.h"
#include "tests/bench/static/static_suite.h"
#include "tests/bench/structures/structures_suite.h"
#include "tests/bench/tuning/tuning_suite.h"

namespace locus::bench {
namespace {

// Returns all suites. Each suite has one line in this function and one folder beside this file.
std::vector<Suite> suites() {
  return {
      {"static", "rays, balls, boxes, builds and memory of one level, compared with Embree and others",
       run_static_suite},
      {"dynamic", "moving objects: moves, queries, memory and readers during writes, compared with Bullet and others",
       dynamic::run_dynamic_suite},
      {"queries",
       "sweeps, sight, contains, nearest, pairs and frustums, as whole batches, compared with Bullet, Embree and CGAL",
       queries::run_queries_suite},
      {"serving", "a server and its client on the loopback, compared with work in process, plain sockets and Redis",
       serving::run_serving_suite},
      {"cluster", "appends to a replicated PostgreSQL, compared with a program that only appends",
       cluster::run_cluster_suite},
      {"structures", "every structure of the index on the same boxes, compared with a list",
       structures::run_structures_suite},
      {"tuning", "the cell size that locus tune names, compared with the best of a sweep over all sizes",
       tuning::run_tuning_suite},
      {"log", "update batches on their way to the disk, compared with appending to a file", log::run_log_suite},
  };
}

constexpr char kExamples[] = R"(Examples:
  locus-bench static --quick
  locus-bench static --json static.json
  locus-bench static --filter '^ray/.*/first' --mesh level.obj
  locus-bench static --mesh city:200000:9 --mesh build/levels/pak1-maps.pk3#maps/delta.bsp
  locus-bench static --filter '^(build|memory)/' --rounds 9
  locus-bench dynamic --filter '^(move|ball)/(uniform|far)/100k'
  locus-bench serving --filter '^rays/' --rounds 9
  TMPDIR=/mnt/disk locus-bench log
  locus-bench structures --filter '^(ball|ray)/.*/uniform/' --plot build/plots
  locus-bench --from build/plots/structures.json --plot build/plots

A MESH is a file that `locus import` reads (FILE, or FILE#ENTRY for a level in a .pk3), or a generated one:
KIND:TRIANGLES or KIND:TRIANGLES:SEED, where KIND is city, terrain or blob. tests/bench/fetch_levels.sh downloads levels
of Debian packages.
Exit codes: 0 ok, 1 failed or results disagree, 2 usage.)";

// Options of the pictures; no suite reads them.
struct PlotOptions {
  std::string folder;                // for the record and the pictures; empty = none
  std::vector<std::string> records;  // files to draw instead of measuring
};

std::string described_suites() {
  return absl::StrCat("One of: ", absl::StrJoin(suites(), "; ", [](std::string* out, const Suite& suite) {
                        absl::StrAppend(out, suite.name, " (", suite.description, ")");
                      }));
}

void add_options(CLI::App& app, Options& options, PlotOptions& plots, std::string& filter, std::string& progress) {
  std::vector<std::string> names;
  for (const Suite& suite : suites()) names.push_back(suite.name);
  app.description("Benchmarks that compare locus with other libraries: ratios, with results that must agree.");
  app.footer(kExamples);
  CLI::Option* const suite = app.add_option("SUITE", options.suite, described_suites())->check(CLI::IsMember(names));
  CLI::Option* const plot = app.add_option("--plot", plots.folder,
                                           "Also write pictures of the ratios as SVG to this folder, drawn by gnuplot, "
                                           "and SUITE.json, from which --from draws them again")
                                ->type_name("DIR");
  app.add_option("--from", plots.records, "Measure nothing; draw the pictures of these files; may be repeated")
      ->type_name("FILE")
      ->needs(plot)
      ->excludes(suite);
  app.add_option("--json", options.json, "Also write the cells to this file")->type_name("FILE");
  app.add_flag("--quick", options.quick, "Every case with a small workload, in under 20 s");
  app.add_option("--filter", filter, "Only cases whose names match")->type_name("REGEX");
  app.add_option("--rounds", options.rounds, "Measured rounds, after one warm-up round [3]")
      ->type_name("N")
      ->check(CLI::Range(kMinRounds, kMaxRounds));
  app.add_option("--mesh", options.meshes, "A mesh instead of the suite's own; may be repeated")
      ->type_name("MESH")
      ->expected(1)
      ->take_all();
  app.add_option("--threads", options.threads, "Threads of the cases that use several [2]")
      ->type_name("N")
      ->check(CLI::Range(2, kMaxThreads));
  app.add_option("--progress", progress, "When to show progress on standard error: auto, always, never [auto]")
      ->type_name("WHEN")
      ->check(CLI::IsMember(std::vector<std::string>{"auto", "always", "never"}));
  app.add_option("--levels", options.levels, "Folder of fetched levels [build/levels]")->type_name("FOLDER");
}

int fail(const absl::Status& status, int code) {
  std::cerr << "locus-bench: " << status.message() << "\n";
  return code;
}

// Returns a writer of progress on standard error. `choice` is auto, always or never.
ProgressWriter start_progress(const std::string& choice) {
  ProgressChoice when = ProgressChoice::kAuto;
  if (choice == "always") when = ProgressChoice::kAlways;
  if (choice == "never") when = ProgressChoice::kNever;
  return ProgressWriter({.style = progress_style(when, isatty(STDERR_FILENO) != 0),
                         .now = [] { return std::chrono::steady_clock::now(); },
                         .write = [](absl::string_view text) { std::cerr << text << std::flush; }});
}

// Draws the pictures of the record and prints their paths.
absl::Status draw_and_list(const Record& record, const std::string& gnuplot, const std::string& folder) {
  ASSIGN_OR_RETURN(const std::vector<std::string> paths, draw(record, gnuplot, folder));
  for (const std::string& path : paths) std::cout << "wrote " << path << "\n";
  return absl::OkStatus();
}

absl::Status draw_records(const PlotOptions& plots) {
  ASSIGN_OR_RETURN(const std::string gnuplot, find_gnuplot());
  for (const std::string& path : plots.records) {
    ASSIGN_OR_RETURN(const Record record, read_record(path));
    RETURN_IF_ERROR(draw_and_list(record, gnuplot, plots.folder));
  }
  return absl::OkStatus();
}

// Writes the record of the run and its pictures to the folder of --plot.
absl::Status plot_run(const std::string& folder, const std::string& gnuplot, const std::vector<std::string>& arguments,
                      const Report& report) {
  if (report.cells.empty()) return absl::FailedPreconditionError("there is nothing to plot: no case matches --filter");
  const Record record = {date_of_today(), name_of_machine(), recorded_arguments(arguments), report.cells};
  RETURN_IF_ERROR(draw_and_list(record, gnuplot, folder));
  return write_record(record, absl::StrCat(folder, "/", record.cells.front().suite, ".json"));
}

int run(const Options& options, const PlotOptions& plots, const std::string& progress_choice,
        const std::vector<std::string>& arguments) {
  // Find gnuplot first, so that no run is in vain.
  std::string gnuplot;
  if (!plots.folder.empty()) {
    absl::StatusOr<std::string> found = find_gnuplot();
    if (!found.ok()) return fail(found.status(), 1);
    gnuplot = *std::move(found);
  }
  const std::vector<Suite> all = suites();
  const auto suite = std::find_if(all.begin(), all.end(), [&](const Suite& one) { return one.name == options.suite; });
  ProgressWriter writer = start_progress(progress_choice);
  const Progress progress = [&](const std::string& sentence) {
    writer.begin({.action = "measuring", .subject = sentence});
  };
  Report report;
  report.on_cell = [&](const Cell& cell) {
    writer.hide();
    write_row(cell, std::cout);
    writer.show();
  };
  write_heading(std::cout);
  const absl::Status run = suite->run(options, progress, report);
  writer.hide();
  if (!run.ok()) return fail(run, 1);
  write_closing(report, std::cout);
  if (!options.json.empty()) {
    const absl::Status written = write_json(report, options.json);
    if (!written.ok()) return fail(written, 1);
  }
  if (!plots.folder.empty()) {
    const absl::Status plotted = plot_run(plots.folder, gnuplot, arguments, report);
    if (!plotted.ok()) return fail(plotted, 1);
  }
  return exit_status(report);
}

// Tunes malloc like the daemon, for all measurements: freed memory is used again instead of being returned to the
// kernel.
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
  mallopt(M_TOP_PAD, 16 << 20);
}

}  // namespace
}  // namespace locus::bench

int main(int argc, char** argv) {
  using locus::bench::CaseFilter;
  locus::bench::keep_freed_memory();
  CLI::App app;
  app.name("locus-bench");
  locus::bench::Options options;
  locus::bench::PlotOptions plots;
  options.levels = "build/levels";
  std::string filter;
  std::string progress = "auto";
  locus::bench::add_options(app, options, plots, filter, progress);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const absl::StatusOr<CaseFilter> cases = CaseFilter::create(filter);
  if (!cases.ok()) return locus::bench::fail(cases.status(), 2);
  options.filter = *cases;
  if (!plots.records.empty()) {
    const absl::Status drawn = locus::bench::draw_records(plots);
    return drawn.ok() ? 0 : locus::bench::fail(drawn, 1);
  }
  if (options.suite.empty()) {
    return locus::bench::fail(absl::InvalidArgumentError("name a SUITE, or draw a file with --from; see --help"), 2);
  }
  return locus::bench::run(options, plots, progress, {argv + 1, argv + argc});
}
