#include "apps/base/plot.hpp"
#include "apps/bench/reduction.hpp"
#include "apps/commands/commands.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace {

using nlohmann::ordered_json;

// ---- the table ----

constexpr const char* reduction_columns =
    "{:<8} {:<14} {:>8} {:>5} {:>7} {:>8} {:>8} {:>5} {:>8} {:>5} {:>6} {:>9} {:>9} {:>9}\n";

void print_reduction_heading() {
  fmt::print(
      "Boom 4 of SPORT, clamped. Seconds of the eigen-solve, of its invariants (reduce) and of the geometric\n"
      "stiffness of 18 loads (Kg, factor given), and their share of the eigen-solve. What the modes lack of the full\n"
      "model: static tip compliance, lateral effective mass, first frequency on a free hinge.\n");
  fmt::print(fmt::runtime(reduction_columns), "element", "mesh", "unknowns", "modes", "threads", "eigen s", "reduce s",
             "%", "Kg s", "%", "MB", "tip", "mass", "hinge");
}

void print_row(const ReductionBench& r) {
  const auto seconds = [](double s) { return fmt::format("{:.3f}", s); };
  const auto share = [&r](double s) { return fmt::format("{:.0f}", 100 * s / r.modes_seconds); };
  const auto error = [](double e) { return fmt::format("{:.1e}", e); };
  fmt::print(fmt::runtime(reduction_columns), r.family, r.model, r.unknowns, r.modes, r.threads,
             seconds(r.modes_seconds), seconds(r.reduce_seconds), share(r.reduce_seconds),
             seconds(r.stiffening_seconds), share(r.stiffening_seconds), fmt::format("{:.0f}", r.memory_mb),
             error(r.compliance_error), error(r.mass_missing), error(r.hinge_error));
  std::fflush(stdout);
}

void print_invariants(const std::vector<InvariantsBench>& rows) {
  fmt::print(
      "\nLargest relative error of the invariants of ten modes against a finer mesh of the same theory: by consistent\n"
      "mass, and as sums over nodal masses (rule of Hinton, Rock and Zienkiewicz) with the same shapes\n");
  constexpr const char* cells = "{:<8} {:<14} {:>8}  {:<10}  {}\n";
  fmt::print(fmt::runtime(cells), "element", "mesh", "unknowns", "sums",
             fmt::format("{:>7}", fmt::join(invariant_names, "  ")));
  for (const InvariantsBench& r : rows) {
    fmt::print(fmt::runtime(cells), r.family, r.model, r.unknowns, "consistent",
               fmt::format("{:7.1e}", fmt::join(r.consistent, "  ")));
    fmt::print(fmt::runtime(cells), "", "", "", "lumped", fmt::format("{:7.1e}", fmt::join(r.lumped, "  ")));
  }
}

// ---- files ----

std::string csv_of(const std::vector<ReductionBench>& rows) {
  std::string text =
      "element,mesh,unknowns,modes,threads,modes_seconds,reduce_seconds,stiffening_seconds,memory_mb,"
      "compliance_error,mass_missing,hinge_error\n";
  for (const ReductionBench& r : rows) {
    text += fmt::format("{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.17g},{:.17g},{:.17g}\n", r.family, r.model,
                        r.unknowns, r.modes, r.threads, r.modes_seconds, r.reduce_seconds, r.stiffening_seconds,
                        r.memory_mb, r.compliance_error, r.mass_missing, r.hinge_error);
  }
  return text;
}

std::string csv_of(const std::vector<InvariantsBench>& rows) {
  std::string text = fmt::format("element,mesh,unknowns,sums,{}\n", fmt::join(invariant_names, ","));
  for (const InvariantsBench& r : rows) {
    text += fmt::format("{},{},{},consistent,{:.17g}\n", r.family, r.model, r.unknowns, fmt::join(r.consistent, ","));
    text += fmt::format("{},{},{},lumped,{:.17g}\n", r.family, r.model, r.unknowns, fmt::join(r.lumped, ","));
  }
  return text;
}

/// null where a mesh could not be compared: JSON has no NaN.
ordered_json json_of(const InvariantErrors& errors) {
  ordered_json result;
  for (size_t i = 0; i < errors.size(); ++i)
    result[invariant_names[i]] = std::isfinite(errors[i]) ? ordered_json(errors[i]) : ordered_json(nullptr);
  return result;
}

ordered_json json_of(const ReductionBenches& bench) {
  ordered_json rows = ordered_json::array(), invariants = ordered_json::array();
  for (const ReductionBench& r : bench.rows)
    rows.push_back({{"element", r.family},
                    {"mesh", r.model},
                    {"unknowns", r.unknowns},
                    {"modes", r.modes},
                    {"threads", r.threads},
                    {"modes_seconds", r.modes_seconds},
                    {"reduce_seconds", r.reduce_seconds},
                    {"stiffening_seconds", r.stiffening_seconds},
                    {"memory_mb", r.memory_mb},
                    {"compliance_error", r.compliance_error},
                    {"mass_missing", r.mass_missing},
                    {"hinge_error", r.hinge_error}});
  for (const InvariantsBench& r : bench.invariants)
    invariants.push_back({{"element", r.family},
                          {"mesh", r.model},
                          {"unknowns", r.unknowns},
                          {"consistent", json_of(r.consistent)},
                          {"lumped", json_of(r.lumped)}});
  return {{"rows", rows}, {"invariants", invariants}};
}

// ---- the picture ----

Plot plot_of_time(const std::vector<ReductionBench>& rows) {
  Plot plot = plot_of_points("Reducing the largest solid: time beside its eigen-solve, one thread", "number of modes",
                             "wall time [s]");
  const auto solid = [](const ReductionBench& r) { return r.family.starts_with("beam") ? 0 : r.unknowns; };
  int largest = 0;
  for (const ReductionBench& r : rows) largest = std::max(largest, solid(r));
  for (const ReductionBench& r : rows) {
    if (solid(r) != largest || r.threads != 1) continue;
    add_point(plot, "eigen-solve", r.modes, r.modes_seconds);
    add_point(plot, "reduce", r.modes, r.reduce_seconds);
    add_point(plot, "Kg of 18 loads", r.modes, r.stiffening_seconds);
  }
  return plot;
}

Plot plot_of_truncation(const std::vector<ReductionBench>& rows) {
  Plot plot =
      plot_of_points("What the modes lack of the full model (hex, graded)", "number of modes", "relative error");
  std::string finest;
  for (const ReductionBench& r : rows) {
    if (r.family == "hex") finest = r.model;
  }
  for (const ReductionBench& r : rows) {
    if (r.family != "hex" || r.model != finest || r.threads != 1) continue;
    add_point(plot, "tip compliance", r.modes, r.compliance_error);
    add_point(plot, "effective mass", r.modes, r.mass_missing);
    add_point(plot, "hinge frequency", r.modes, r.hinge_error);
  }
  return plot;
}

Plot plot_of_invariants(const std::vector<InvariantsBench>& rows) {
  Plot plot = plot_of_points("Invariants of ten modes: largest error of all, consistent and lumped", "unknowns",
                             "relative error");
  plot.log_x = true;
  for (const InvariantsBench& r : rows) {
    add_point(plot, r.family, r.unknowns, *std::ranges::max_element(r.consistent));
    add_point(plot, r.family + ", lumped", r.unknowns, *std::ranges::max_element(r.lumped));
  }
  return plot;
}

}  // namespace

int bench_reduction_command(const BenchArguments& a, const CommonOptions& common) {
  const std::filesystem::path folder =
      common.out.empty() ? std::filesystem::path("results/bench_reduction") : common.out;
  const bool table = !common.json && !common.quiet;
  std::filesystem::create_directories(folder);
  if (table) print_reduction_heading();
  const ReductionBenches bench = bench_reduction(a.longest, common.threads, [table](const ReductionBench& row) {
    if (table) print_row(row);
  });
  if (table) print_invariants(bench.invariants);
  write_file(folder / "bench_reduction.csv", csv_of(bench.rows));
  write_file(folder / "bench_reduction_invariants.csv", csv_of(bench.invariants));
  write_file(folder / "bench_reduction.svg",
             stacked({plot_of_time(bench.rows), plot_of_truncation(bench.rows), plot_of_invariants(bench.invariants)}));
  if (common.json) fmt::print("{}\n", json_of(bench).dump(2));
  if (!common.quiet) print_note(fmt::format("tables and picture: {}", (folder / "bench_reduction.svg").string()));
  return exit_ok;
}

}  // namespace flexboom
