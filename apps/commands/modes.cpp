#include "apps/base/usage.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/terminal_line.hpp"
#include "apps/model/bounded_modes.hpp"
#include "apps/model/picture.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/booms/beam_limits.hpp"
#include "fem/formats/common/mesh_file.hpp"
#include "fem/formats/vtk/vtk.hpp"
#include "reduction/invariants/inertia_invariants.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

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

/// Points of the mesh and every shape as a field of displacement over them. Beams are drawn along their deformed axis.
VtkGrid shapes_grid(const BoundedModes& m) {
  const Model& model = m.model;
  const Assembly& assembly = m.assembly;
  const ModalBasis& basis = m.basis;
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
  add_cells(display, 0, grid);
  for (int k = 0; k < modes; ++k) {
    Eigen::MatrixXd field(3, grid.points.cols());
    for (Eigen::Index i = 0; i < field.cols(); ++i) field.col(i) = display.S[static_cast<size_t>(i)].col(k);
    grid.point_data.emplace_back(field_name(k), field);
  }
  return grid;
}

/// Numbers, null where one is unknown.
ordered_json known(const Eigen::VectorXd& values) {
  ordered_json list = ordered_json::array();
  for (const double v : values) list.push_back(std::isnan(v) ? ordered_json(nullptr) : ordered_json(v));
  return list;
}

template <class T>
ordered_json null_or(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

double worst_bound(const BoundedModes& m) { return m.bounds.worst(m.basis.rigid_freedoms); }

ordered_json json_of(const BoundedModes& m, double total_seconds) {
  const ModalBasis& basis = m.basis;
  const EigenSummary& s = basis.summary;
  const Eigen::VectorXd hz = basis.omega / (2 * std::numbers::pi);
  std::vector<std::string_view> kinds;
  for (const ModeKind k : basis.kind) kinds.push_back(name_of(k));
  return {{"frequencies_hz", std::vector<double>(hz.begin(), hz.end())},
          {"error_bounds", known(m.bounds.relative)},
          {"error_bounds_found", m.bounds.how},
          {"accuracy", null_or(m.accuracy)},
          {"accuracy_met", null_or(m.met())},
          {"kinds", kinds},
          {"dofs", basis.unknowns},
          {"elements", m.model.mesh.elements.size()},
          {"mass", basis.mass},
          {"rigid_freedoms", basis.rigid_freedoms},
          {"seconds",
           {{"mesh", m.mesh_seconds},
            {"assemble", m.assemble_seconds},
            {"analyse", s.analyse_seconds},
            {"factor", s.factor_seconds},
            {"eigen", s.eigen_seconds},
            {"verify", s.verify_seconds},
            {"modes", m.modes_seconds},
            {"bounds", m.bound_seconds},
            {"total", total_seconds}}},
          {"factor_mb", s.factor_bytes / (1 << 20)},
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
          {"notes", m.model.notes},
          {"peak_memory_mb", peak_memory_mb()}};
}

void print_table(const BoundedModes& m, double total_seconds) {
  const ModalBasis& basis = m.basis;
  const EigenSummary& s = basis.summary;
  fmt::print("{}: {} elements, {} unknowns, mass {:.9g} kg\n", m.model.name, m.model.mesh.elements.size(),
             basis.unknowns, basis.mass);
  for (Eigen::Index k = 0; k < basis.omega.size(); ++k) {
    const double bound = m.bounds.relative[k];
    fmt::print("{:4}  {:18.10f} Hz  {:<8}  {}\n", k + 1, basis.omega(k) / (2 * std::numbers::pi),
               k < basis.rigid_freedoms ? ""
               : std::isnan(bound)      ? "?"
                                        : fmt::format("+-{:.0e}", bound),
               name_of(basis.kind[static_cast<size_t>(k)]));
  }
  const double worst = worst_bound(m);
  print_note(basis.rigid_freedoms >= basis.omega.size()
                 ? "errors of the mesh: none, all of these are rigid motions"
                 : fmt::format("errors of the mesh: {}, {}",
                               std::isnan(worst) ? "not known of every mode" : fmt::format("at most {:.1e}", worst),
                               m.bounds.how));
  print_note(fmt::format("{}: residual {:.1e}, orthogonality {:.1e}; {}", s.backend, s.residual_max,
                         s.orthogonality_error, s.proof));
  print_note(
      fmt::format("{:.3f} s: mesh {:.3f}, assembly {:.3f}, analysis {:.3f}, factor {:.3f}, modes {:.3f}, "
                  "verification {:.3f}, bounds {:.3f}; {:.0f} MB",
                  total_seconds, m.mesh_seconds, m.assemble_seconds, s.analyse_seconds, s.factor_seconds,
                  s.eigen_seconds, s.verify_seconds, m.bound_seconds, peak_memory_mb()));
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
  require(a.vtu.empty() || a.vtu.extension() == ".vtu", fmt::format("--vtu: '{}' must end in .vtu", a.vtu.string()));
  require_not_replaced(a.model, a.vtu);
  const Stopwatch clock;
  std::optional<WorkLine> progress(std::in_place, !common.quiet && !common.json, "modes");
  Model model = load_model(a.model, a.options);
  const double load_seconds = clock.seconds();
  if (!common.quiet) {
    for (const std::string& note : model.notes) print_note("note: " + note);
  }
  const EigenOptions options = eigen_options(a, model);
  BoundedModes m = bounded_modes(std::move(model), options, common.threads);
  m.mesh_seconds += load_seconds;
  if (m.model.body && m.model.body->structure == "beam")
    if (std::string doubt = section_doubt(m.model.body->geometry, m.basis.omega.maxCoeff() / (2 * std::numbers::pi));
        !doubt.empty()) {
      if (!common.quiet) print_note("note: " + doubt);
      m.model.notes.push_back(std::move(doubt));
    }
  if (!a.vtu.empty()) write_vtu(a.vtu, shapes_grid(m));
  progress.reset();
  if (common.json) {
    fmt::print("{}\n", json_of(m, clock.seconds()).dump(2));
  } else if (!common.quiet) {
    print_table(m, clock.seconds());
  }
  if (m.met() == false && !common.quiet) {
    const double worst = worst_bound(m);
    print_note(fmt::format("warning: the accuracy wanted, {:.1e}, was not reached, or not proven: the bound is {}",
                           *m.accuracy, std::isnan(worst) ? "not known" : fmt::format("{:.1e}", worst)));
  }
  return exit_ok;
}

}  // namespace flexboom
