#include "apps/commands.hpp"
#include "apps/results.hpp"
#include "apps/scene.hpp"
#include "fem/check.hpp"
#include "fem/vtk.hpp"
#include "reduction/inertia_invariants.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <numbers>

namespace flexboom {

using nlohmann::ordered_json;

namespace {

Material parse_material(const std::string& text) {
  Material m;
  char rest = 0;
  require(std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &m.E, &m.nu, &m.rho, &rest) == 3,
          fmt::format("--material: '{}' is not E,nu,rho, e.g. 67e9,0.33,2840", text));
  m.validate();
  return m;
}

BodyScene body_of(const ModesArguments& a) {
  const std::string extension = std::filesystem::path(a.model).extension().string();
  require(extension == ".toml",
          fmt::format("{}: this version reads bodies from .toml files, not '{}'", a.model, extension));
  BodyScene body = read_body(a.model);
  if (a.material)
    for (BeamSegment& s : body.geometry.segments) s.material = parse_material(*a.material);
  if (a.clamp) body.clamp = *a.clamp;
  return body;
}

double peak_memory_mb() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Every shape as a field of displacement over the boom's centre line.
void write_shapes(const std::filesystem::path& file, const ReducedBody& body) {
  VtkGrid grid;
  grid.points = body.display.points;
  constexpr int vtk_line = 3;  // two points: meshio skips polylines
  for (const std::vector<int>& line : body.display.lines)
    for (size_t k = 0; k + 1 < line.size(); ++k) grid.cells.push_back({vtk_line, {line[k], line[k + 1]}});
  for (int k = 0; k < body.n(); ++k) {
    Eigen::MatrixXd field(3, grid.points.cols());
    for (Eigen::Index i = 0; i < field.cols(); ++i) field.col(i) = body.display.S[static_cast<size_t>(i)].col(k);
    grid.point_data.emplace_back(fmt::format("mode_{:03d}_{}", k + 1, body.coordinates[static_cast<size_t>(k)].kind),
                                 field);
  }
  write_vtu(file, grid);
}

struct Stopwatch {
  std::chrono::steady_clock::time_point last = std::chrono::steady_clock::now();
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double s = std::chrono::duration<double>(now - last).count();
    last = now;
    return s;
  }
};

}  // namespace

int modes_command(const ModesArguments& a, const CommonOptions& common) {
  require(a.count > 0, "--count must be positive");
  const BodyScene body = body_of(a);
  if (body.structure == "eq14" && !common.quiet)
    print_note("note: modes solves finite elements; the closed form of structure = \"eq14\" is in `flexboom compare`");
  Stopwatch watch;
  const Mesh mesh = make_mesh(body.geometry);
  const double mesh_seconds = watch.lap();
  const Assembly assembly = assemble(mesh);
  const double assemble_seconds = watch.lap();
  EigenOptions options;
  options.num_modes = a.count;
  options.backend = a.backend;
  const std::vector<int> clamp = a.free ? std::vector<int>{} : node_set(mesh, body.clamp);
  const ModalBasis basis = clamped_modes(mesh, assembly, clamp, options);
  const double eigen_seconds = watch.lap();
  const ReducedBody reduced = reduce(mesh, assembly, basis, body.name);
  if (!a.vtu.empty()) write_shapes(a.vtu, reduced);

  const EigenSummary& s = basis.summary;
  const auto dofs = free_dofs(assembly.dofs, clamp).size();
  const Eigen::VectorXd hz = basis.omega / (2 * std::numbers::pi);
  if (common.json) {
    std::vector<std::string_view> kinds;
    for (const ModeKind k : basis.kind) kinds.push_back(name_of(k));
    ordered_json j = {{"frequencies_hz", std::vector<double>(hz.begin(), hz.end())},
                      {"kinds", kinds},
                      {"dofs", dofs},
                      {"elements", mesh.elements.size()},
                      {"mass", reduced.m},
                      {"seconds",
                       {{"mesh", mesh_seconds},
                        {"assemble", assemble_seconds},
                        {"factor", s.factor_seconds},
                        {"eigen", s.eigen_seconds},
                        {"total", mesh_seconds + assemble_seconds + eigen_seconds}}},
                      {"backend", s.backend},
                      {"shift", s.sigma},
                      {"residual_max", s.residual_max},
                      {"orthogonality_error", s.orthogonality_error},
                      {"sturm_count", s.sturm_count},
                      {"pairs", s.pairs},
                      {"peak_memory_mb", peak_memory_mb()}};
    fmt::print("{}\n", j.dump(2));
    return exit_ok;
  }
  if (common.quiet) return exit_ok;
  fmt::print("{}: {} elements, {} unknowns, mass {:.9g} kg\n", body.name, mesh.elements.size(), dofs, reduced.m);
  for (Eigen::Index k = 0; k < hz.size(); ++k)
    fmt::print("{:4}  {:18.10f} Hz  {}\n", k + 1, hz[k], name_of(basis.kind[static_cast<size_t>(k)]));
  print_note(
      fmt::format("{}: residual {:.1e}, orthogonality {:.1e}, Sturm count {} below {:.6g} Hz: no mode missed; {:.3f} s",
                  s.backend, s.residual_max, s.orthogonality_error, s.sturm_count,
                  std::sqrt(std::max(0.0, s.sturm_shift)) / (2 * std::numbers::pi),
                  mesh_seconds + assemble_seconds + eigen_seconds));
  return exit_ok;
}

}  // namespace flexboom
