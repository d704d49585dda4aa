#include "apps/base/plot.hpp"
#include "apps/bench/transient.hpp"
#include "apps/commands/commands.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace flexboom {
namespace {

using nlohmann::ordered_json;

constexpr const char* transient_columns =
    "{:<16} {:<12} {:>9} {:>9} {:>9} {:>10} {:>9} {:>9} {:>9} {:>8} {:>10} {:>7}\n";

void print_transient_heading() {
  fmt::print(
      "Seconds of integration, times real time, and the errors reached: largest of all outputs and of the hub's\n"
      "rotation, each over its largest value; reference: another method, or the same where it is the only one\n");
  fmt::print(fmt::runtime(transient_columns), "scene", "method", "tolerance", "reference", "s", "real time", "outputs",
             "hub", "energy", "steps", "evaluations", "events");
}

void print_row(const TransientBench& r) {
  const auto number = [](double v) { return fmt::format("{:.1e}", v); };
  if (r.failure.empty()) {
    fmt::print(fmt::runtime(transient_columns), r.scene, r.method, fmt::format("{:.0e}", r.tolerance),
               fmt::format("{:.0e}", r.reference), fmt::format("{:.4f}", r.seconds),
               fmt::format("{:.0f}", r.simulated / r.seconds), number(r.error), number(r.hub_error), number(r.energy),
               r.steps, r.evaluations, r.events);
  } else {
    fmt::print("{:<16} {:<12} {:>9.0e} {}\n", r.scene, r.method, r.tolerance, r.failure);
  }
  std::fflush(stdout);
}

std::string csv_of(const std::vector<TransientBench>& rows) {
  std::string text =
      "scene,method,tolerance,reference,seconds,simulated,error,hub_error,energy,steps,evaluations,events\n";
  for (const TransientBench& r : rows) {
    if (!r.failure.empty()) continue;
    text += fmt::format("\"{}\",{},{:g},{:g},{:.6g},{:g},{:.17g},{:.17g},{:.6g},{},{},{}\n", r.scene, r.method,
                        r.tolerance, r.reference, r.seconds, r.simulated, r.error, r.hub_error, r.energy, r.steps,
                        r.evaluations, r.events);
  }
  return text;
}

ordered_json json_of(const std::vector<TransientBench>& rows) {
  ordered_json list = ordered_json::array();
  for (const TransientBench& r : rows) {
    ordered_json row = {{"scene", r.scene}, {"method", r.method}, {"tolerance", r.tolerance}};
    if (r.failure.empty())
      row.update({{"reference_tolerance", r.reference},
                  {"seconds", r.seconds},
                  {"simulated_seconds", r.simulated},
                  {"error", r.error},
                  {"hub_error", r.hub_error},
                  {"energy_balance", r.energy},
                  {"steps", r.steps},
                  {"rhs_evaluations", r.evaluations},
                  {"events", r.events}});
    else
      row["failure"] = r.failure;
    list.push_back(row);
  }
  return list;
}

/// One plot for each scene: error of all outputs against time, a curve for each method.
std::vector<Plot> plots_of(const std::vector<TransientBench>& rows) {
  std::vector<Plot> plots;
  for (const TransientBench& r : rows) {
    if (!r.failure.empty() || !(r.error > 0)) continue;
    const std::string title = fmt::format("{}, {:g} s", r.scene, r.simulated);
    if (plots.empty() || plots.back().title != title) {
      plots.push_back(plot_of_points(title, "time of the integration, one core [s]", "largest error of all outputs"));
      plots.back().log_x = true;
    }
    add_point(plots.back(), r.method, r.seconds, r.error);
  }
  return plots;
}

}  // namespace

int bench_transient_command(const BenchArguments& a, const CommonOptions& common) {
  const std::filesystem::path folder =
      common.out.empty() ? std::filesystem::path("results/bench_transient") : common.out;
  const bool table = !common.json && !common.quiet;
  std::filesystem::create_directories(folder);
  if (table) print_transient_heading();
  const std::vector<TransientBench> rows = bench_transient(a.scenes, a.longest, [table](const TransientBench& row) {
    if (table) print_row(row);
  });
  write_file(folder / "bench_transient.csv", csv_of(rows));
  write_file(folder / "bench_transient.svg", stacked(plots_of(rows)));
  if (common.json) fmt::print("{}\n", json_of(rows).dump(2));
  if (!common.quiet) print_note(fmt::format("table and picture: {}", (folder / "bench_transient.svg").string()));
  return exit_ok;
}

}  // namespace flexboom
