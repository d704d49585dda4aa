#include "apps/base/plot.hpp"
#include "apps/bench/modes.hpp"
#include "apps/commands/commands.hpp"
#include "fem/base/files.hpp"
#include "fem/base/process.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace flexboom {
namespace {

using nlohmann::ordered_json;

constexpr const char* heading = "{:<16} {:<16} {:>9} {:>9} {:>8} {:>7} {:>9} {:>8} {:>9} {:>10}\n";

void print_modes_heading() {
  fmt::print("Boom 4 of SPORT, clamped, modes 1 to 10, one thread, whole processes; error against the 3D reference\n");
  fmt::print(fmt::runtime(heading), "element", "mesh", "unknowns", "error", "s", "MB", "ccx s", "ccx MB", "ccx/here",
             "difference");
}

void print_row(const ModesBench& r) {
  const bool paired = r.ccx_seconds > 0;
  const auto cell = [paired](const char* format, double value) {
    return paired ? fmt::format(fmt::runtime(format), value) : std::string();
  };
  fmt::print(fmt::runtime(heading), r.family, r.model, r.unknowns, fmt::format("{:.1e}", r.error),
             fmt::format("{:.2f}", r.seconds), fmt::format("{:.0f}", r.memory_mb), cell("{:.2f}", r.ccx_seconds),
             cell("{:.0f}", r.ccx_memory_mb), cell("{:.1f}", r.ccx_seconds / r.seconds), cell("{:.1e}", r.difference));
  std::fflush(stdout);
}

std::string csv_of(const std::vector<ModesBench>& rows) {
  std::string text = "element,mesh,unknowns,error,seconds,memory_mb,ccx_seconds,ccx_memory_mb,ccx_difference\n";
  for (const ModesBench& r : rows) {
    text +=
        fmt::format("{},{},{},{:.17g},{:.6g},{:.6g}", r.family, r.model, r.unknowns, r.error, r.seconds, r.memory_mb);
    text += r.ccx_seconds > 0 ? fmt::format(",{:.6g},{:.6g},{:.6g}\n", r.ccx_seconds, r.ccx_memory_mb, r.difference)
                              : std::string(",,,\n");
  }
  return text;
}

std::string picture_of(const std::vector<ModesBench>& rows) {
  Plot plot = plot_of_points("Clamped boom 4: largest error of modes 1-10 against time",
                             "wall time of the whole process, one thread [s]", "relative error of frequency");
  plot.log_x = true;
  plot.height = 440;
  for (const ModesBench& r : rows) {
    add_point(plot, r.family, r.seconds, r.error);
    if (r.ccx_seconds > 0) add_point(plot, r.family + " CalculiX", r.ccx_seconds, r.error);
  }
  return svg(plot);
}

ordered_json json_of(const std::vector<ModesBench>& rows) {
  ordered_json list = ordered_json::array();
  for (const ModesBench& r : rows) {
    ordered_json row = {{"element", r.family}, {"mesh", r.model},      {"unknowns", r.unknowns},
                        {"error", r.error},    {"seconds", r.seconds}, {"memory_mb", r.memory_mb}};
    if (r.ccx_seconds > 0)
      row.update({{"ccx_seconds", r.ccx_seconds}, {"ccx_memory_mb", r.ccx_memory_mb}, {"difference", r.difference}});
    list.push_back(row);
  }
  return list;
}

}  // namespace

int bench_modes_command(const BenchArguments& a, const CommonOptions& common) {
  const std::filesystem::path folder = common.out.empty() ? std::filesystem::path("results/bench_modes") : common.out;
  const bool table = !common.json && !common.quiet;
  if (table) print_modes_heading();
  if (program_on_path("ccx").empty() && !common.quiet)
    print_note("note: no program ccx on the PATH, so nothing is compared with CalculiX (Debian: calculix-ccx)");
  const std::vector<ModesBench> rows = bench_modes(folder, a.longest, [&](const ModesBench& row) {
    if (table) print_row(row);
  });
  write_file(folder / "bench_modes.csv", csv_of(rows));
  write_file(folder / "bench_modes.svg", picture_of(rows));
  if (common.json) fmt::print("{}\n", json_of(rows).dump(2));
  if (!common.quiet) print_note(fmt::format("table and picture: {}", (folder / "bench_modes.svg").string()));
  return exit_ok;
}

}  // namespace flexboom
