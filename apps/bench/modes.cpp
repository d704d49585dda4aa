#include "apps/bench/modes.hpp"

#include "apps/bench/boom4.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/process.hpp"
#include "fem/formats/abaqus/write.hpp"
#include "fem/formats/common/mesh_file.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace flexboom {
namespace {

constexpr int modes = 10;

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < modes || b.size() < modes) return std::nan("");
  double largest = 0;
  for (size_t k = 0; k < modes; ++k) largest = std::max(largest, std::abs(a[k] / b[k] - 1));
  return largest;
}

/// Fills the row from a whole run of this program on a body file or deck.
void run_flexboom(ModesBench& row, const std::filesystem::path& file, const std::vector<std::string>& options,
                  std::vector<double>& hz) {
  std::vector<std::string> command = {
      this_program(),       "modes", file.filename().string(), "--json", "--quiet", "--threads", "1", "--count",
      std::to_string(modes)};
  command.insert(command.end(), options.begin(), options.end());
  const ProcessResult run = run_process(command, {.folder = file.parent_path(), .one_thread = true});
  require(run.exit_code == 0, fmt::format("bench: flexboom modes {} ended with code {}", file.string(), run.exit_code));
  const auto answer = nlohmann::json::parse(run.output);
  hz = answer.at("frequencies_hz").get<std::vector<double>>();
  row.unknowns = answer.at("dofs").get<int>();
  row.seconds = run.seconds;
  row.memory_mb = run.memory_mb;
  row.error = largest_difference(hz, boom4_reference_hz());
}

/// Frequencies [Hz] of the table that CalculiX prints into its .dat file.
std::vector<double> calculix_frequencies(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<double> hz;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    int mode = 0;
    double eigenvalue = 0, omega = 0, frequency = 0;
    if (cells >> mode >> eigenvalue >> omega >> frequency && mode == std::ssize(hz) + 1) hz.push_back(frequency);
    if (line.find("P A R T I C I P A T I O N") != std::string::npos) break;
  }
  return hz;
}

void run_calculix(ModesBench& row, const std::filesystem::path& deck, const std::vector<double>& hz) {
  const std::string program = program_on_path("ccx");
  if (program.empty()) return;
  const ProcessResult run =
      run_process({program, deck.stem().string()}, {.folder = deck.parent_path(), .one_thread = true});
  if (run.exit_code != 0) return;
  row.ccx_seconds = run.seconds;
  row.ccx_memory_mb = run.memory_mb;
  row.difference = largest_difference(hz, calculix_frequencies(std::filesystem::path(deck).replace_extension(".dat")));
}

/// A ladder of uniform meshes of one element, written as decks so that both programs read the same file.
struct Ladder {
  std::string element;
  bool with_calculix;
  std::vector<Rung> rungs;
};

const std::vector<Ladder>& ladders() {
  static const std::vector<Ladder> all = {
      {"hex20", true, {hex20_rungs.begin(), hex20_rungs.end()}},
      {"hex20-reduced", false, {{1, 1, 38}, {2, 1, 76}, {3, 2, 76}, {4, 2, 100}}},
      {"tet10", true, {{1, 1, 30}, {2, 1, 40}, {2, 2, 76}, {4, 2, 84}}},
      {"hex8", false, {{2, 1, 76}, {4, 2, 151}, {8, 4, 302}}},
      {"tet4", false, {{2, 1, 76}, {4, 2, 151}, {8, 4, 302}}},
  };
  return all;
}

Mesh held_mesh(const std::string& element, const Rung& rung) {
  Mesh mesh = uniform_mesh(element, rung);
  for (const int node : node_set(mesh, "root"))
    mesh.supports.push_back({node, {true, true, true, false, false, false}});
  return mesh;
}

class ModesLadder {
 public:
  ModesLadder(std::filesystem::path folder, double longest, const std::function<void(const ModesBench&)>& seen)
      : folder_(std::move(folder)), longest_(longest), seen_(seen) {}

  void graded_hexahedra() {
    write_body_file();
    for (const double accuracy : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
      ModesBench row{.family = "hex, graded", .model = fmt::format("accuracy {:g}", accuracy)};
      std::vector<double> hz;
      run_flexboom(row, folder_ / "boom4.toml", {"--structure", "solid", "--accuracy", fmt::format("{:g}", accuracy)},
                   hz);
      add(row);
      if (row.seconds > longest_) return;
    }
  }

  void beams() {
    ModesBench row{.family = "beam-timoshenko", .model = "order 8"};
    std::vector<double> hz;
    run_flexboom(row, folder_ / "boom4.toml", {"--order", "8"}, hz);
    add(row);
  }

  void uniform(const Ladder& ladder) {
    for (const Rung& rung : ladder.rungs) {
      ModesBench row{.family = ladder.element,
                     .model = fmt::format("{} x {} x {}", rung.sectors, rung.rings, rung.along)};
      const std::filesystem::path deck =
          folder_ / fmt::format("{}_{}_{}_{}.inp", ladder.element, rung.sectors, rung.rings, rung.along);
      write_abaqus(deck, held_mesh(ladder.element, rung), modes);
      std::vector<double> hz;
      run_flexboom(row, deck, {}, hz);
      if (ladder.with_calculix) run_calculix(row, deck, hz);
      add(row);
      // Cost grows at least in proportion to the unknowns, which the next rung has three times as many of.
      if (3 * std::max(row.seconds, row.ccx_seconds) > longest_) return;
    }
  }

  std::vector<ModesBench> take() { return std::move(rows_); }

 private:
  void write_body_file() {
    write_file(folder_ / "boom4.toml",
               "format = \"flexboom-body-1\"\n"
               "name = \"boom4\"\n"
               "[[segments]]\n"
               "shape = \"round-bar\"\n"
               "diameter = 0.010\n"
               "length = 0.302\n"
               "material = { E = 67e9, nu = 0.33, rho = 2840.0 }\n");
  }

  void add(const ModesBench& row) {
    rows_.push_back(row);
    seen_(row);
  }

  std::filesystem::path folder_;
  double longest_;
  const std::function<void(const ModesBench&)>& seen_;
  std::vector<ModesBench> rows_;
};

}  // namespace

std::vector<double> boom4_reference_hz() {
  const Material m = boom4().segments.front().material;
  const double torsion = std::sqrt(m.shear_modulus() / m.rho) / (4 * boom4().length());
  return {74.57570632384,  74.57570632384, 465.60850721105, 465.60850721105, 1296.0223559708,
          1296.0223559708, torsion,        2518.2917811872, 2518.2917811872, 4024.8984845735};
}

std::vector<ModesBench> bench_modes(const std::filesystem::path& folder, double longest,
                                    const std::function<void(const ModesBench&)>& seen) {
  std::filesystem::create_directories(folder);
  ModesLadder bench(std::filesystem::absolute(folder), longest, seen);
  bench.graded_hexahedra();
  bench.beams();
  for (const Ladder& ladder : ladders()) bench.uniform(ladder);
  return bench.take();
}

}  // namespace flexboom
