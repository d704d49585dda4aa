#include "apps/commands/commands.hpp"
#include "fem/base/check.hpp"
#include "fem/formats/common/mesh_file.hpp"
#include "fem/formats/vtk/vtk.hpp"
#include "reduction/invariants/inertia_invariants.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <numbers>

namespace flexboom {

using nlohmann::ordered_json;

namespace {

constexpr int default_count = 10;

/// Largest resident memory of this process so far [MB].
double peak_memory_mb() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Wall time and peak memory of the stages, one after another.
class Stages {  // NOLINT(bugprone-exception-escape): of maps that are moved
 public:
  void end(const std::string& name) {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    total_ += elapsed;
    seconds_[name] = elapsed;
    memory_[name] = peak_memory_mb();
  }
  double seconds(const std::string& name) const { return seconds_.at(name); }
  double total() const { return total_; }
  const ordered_json& memory() const { return memory_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double total_ = 0;
  ordered_json seconds_, memory_;
};

/// Points of the mesh and every shape as a field of displacement over them. Beams are drawn along their deformed axis.
VtkGrid shapes_grid(const Model& model, const Assembly& assembly, const ModalBasis& basis) {
  const auto is_beam = [](const Element& e) { return type_of(e).shape == Shape::line; };
  const auto field_name = [&basis](int k) {
    return fmt::format("mode_{:03d}_{}", k + 1, name_of(basis.kind[static_cast<size_t>(k)]));
  };
  const auto modes = static_cast<int>(basis.Phi.cols());
  if (!std::ranges::all_of(model.mesh.elements, is_beam)) {
    VtkGrid grid = vtk_grid(model.mesh);
    for (int k = 0; k < modes; ++k) {
      const Eigen::Matrix3Xd nodal = nodal_displacement(model.mesh, assembly.dofs, basis.Phi.col(k));
      grid.point_data.emplace_back(field_name(k), vtk_point_values(model.mesh, nodal));
    }
    return grid;
  }
  const DisplayShape display = reduce(model.mesh, assembly, basis, model.name).display;
  VtkGrid grid;
  grid.points = display.points;
  constexpr int vtk_line = 3;  // two points: meshio skips polylines
  for (const std::vector<int>& line : display.lines) {
    for (size_t k = 0; k + 1 < line.size(); ++k) grid.cells.push_back({vtk_line, {line[k], line[k + 1]}});
  }
  for (int k = 0; k < modes; ++k) {
    Eigen::MatrixXd field(3, grid.points.cols());
    for (Eigen::Index i = 0; i < field.cols(); ++i) field.col(i) = display.S[static_cast<size_t>(i)].col(k);
    grid.point_data.emplace_back(field_name(k), field);
  }
  return grid;
}

ordered_json json_of(const Model& model, const ModalBasis& basis, const Stages& stages) {
  const EigenSummary& s = basis.summary;
  const Eigen::VectorXd hz = basis.omega / (2 * std::numbers::pi);
  std::vector<std::string_view> kinds;
  for (const ModeKind k : basis.kind) kinds.push_back(name_of(k));
  return {{"frequencies_hz", std::vector<double>(hz.begin(), hz.end())},
          {"kinds", kinds},
          {"dofs", basis.unknowns},
          {"elements", model.mesh.elements.size()},
          {"mass", basis.mass},
          {"rigid_freedoms", basis.rigid_freedoms},
          {"seconds",
           {{"mesh", stages.seconds("mesh")},
            {"assemble", stages.seconds("assemble")},
            {"analyse", s.analyse_seconds},
            {"factor", s.factor_seconds},
            {"eigen", s.eigen_seconds},
            {"verify", s.verify_seconds},
            {"modes", stages.seconds("modes")},
            {"total", stages.total()}}},
          {"memory_mb",
           {{"mesh", stages.memory().at("mesh")},
            {"assemble", stages.memory().at("assemble")},
            {"modes", stages.memory().at("modes")},
            {"factor", s.factor_bytes / (1 << 20)}}},
          {"backend", s.backend},
          {"ordering", s.ordering},
          {"factor_entries", s.factor_nonzeros},
          {"solves", s.solves},
          {"shift", s.sigma},
          {"residual_max", s.residual_max},
          {"orthogonality_error", s.orthogonality_error},
          {"sturm_count", s.sturm_checked ? ordered_json(s.sturm_count) : ordered_json(nullptr)},
          {"proof", s.proof},
          {"pairs", s.pairs},
          {"notes", model.notes},
          {"peak_memory_mb", peak_memory_mb()}};
}

void print_table(const Model& model, const ModalBasis& basis, const Stages& stages) {
  const EigenSummary& s = basis.summary;
  fmt::print("{}: {} elements, {} unknowns, mass {:.9g} kg\n", model.name, model.mesh.elements.size(), basis.unknowns,
             basis.mass);
  for (Eigen::Index k = 0; k < basis.omega.size(); ++k) {
    fmt::print("{:4}  {:18.10f} Hz  {}\n", k + 1, basis.omega(k) / (2 * std::numbers::pi),
               name_of(basis.kind[static_cast<size_t>(k)]));
  }
  print_note(fmt::format("{}: residual {:.1e}, orthogonality {:.1e}; {}", s.backend, s.residual_max,
                         s.orthogonality_error, s.proof));
  print_note(
      fmt::format("{:.3f} s: mesh {:.3f}, assembly {:.3f}, analysis {:.3f}, factor {:.3f}, modes {:.3f}, "
                  "verification {:.3f}; {:.0f} MB",
                  stages.total(), stages.seconds("mesh"), stages.seconds("assemble"), s.analyse_seconds,
                  s.factor_seconds, s.eigen_seconds, s.verify_seconds, peak_memory_mb()));
}

EigenOptions eigen_options(const ModesArguments& a, const Model& model) {
  EigenOptions options;
  options.num_modes = a.count.value_or(model.modes.value_or(default_count));
  options.backend = a.backend.value_or(model.backend.value_or("auto"));
  options.sturm = a.verify == "sturm"   ? SturmPolicy::always
                  : a.verify == "basic" ? SturmPolicy::never
                                        : SturmPolicy::when_cheap;
  return options;
}

}  // namespace

int modes_command(const ModesArguments& a, const CommonOptions& common) {
  require(!a.count || *a.count > 0, "--count must be positive");
  Stages stages;
  Model model = load_model(a.model, a.options);
  stages.end("mesh");
  if (!common.quiet) {
    for (const std::string& note : model.notes) print_note("note: " + note);
  }
  Assembly assembly = assemble(model.mesh, common.threads);
  stages.end("assemble");
  const ModalBasis basis =
      clamped_modes_releasing(model.mesh, assembly, model.clamp, eigen_options(a, model), common.threads);
  stages.end("modes");
  if (!a.vtu.empty()) write_vtu(a.vtu, shapes_grid(model, assembly, basis));
  if (common.json) {
    fmt::print("{}\n", json_of(model, basis, stages).dump(2));
  } else if (!common.quiet) {
    print_table(model, basis, stages);
  }
  return exit_ok;
}

}  // namespace flexboom
