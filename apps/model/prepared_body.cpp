// Bodies of a scene: from what the file says to a reduced body.

#include "apps/model/prepared_body.hpp"

#include "apps/base/version.hpp"
#include "apps/model/picture.hpp"
#include "apps/model/reduction.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/mode_selection.hpp"
#include "reduction/body_file/body_file.hpp"
#include "reduction/body_file/sha256.hpp"
#include "reduction/invariants/eq14.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

PreparedBody prepare_rigid(const BodyScene& b) {
  const RigidScene& r = *b.rigid;
  const Vector3d mc0 = r.mass * r.centre;
  PreparedBody p;
  p.body = rigid_body(b.name, r.mass, mc0, r.inertia + centre_inertia(r.mass, mc0));
  p.body.display = box_of(p.body, r.size);
  return p;
}

/// As a file has it.
PreparedBody prepared(ReducedBody body) {
  PreparedBody p;
  p.body = std::move(body);
  p.dofs = p.body.full_freedoms;
  p.checks = p.body.certificate;
  p.modes = p.body.n();
  return p;
}

PreparedBody prepare_reduced(const BodyScene& b, int refine) {
  const bool finer = refine > 0 && b.richer && b.richer->finer_elements;
  PreparedBody p = prepared(finer ? *b.richer->finer_elements : *b.reduced);
  p.body.name = b.name;
  if (b.other_damping) apply_damping(p.body, *b.other_damping);
  if (p.body.display.points.cols() == 0) p.body.display = box_of(p.body);
  return p;
}

PreparedBody prepare_eq14(const BodyScene& b) {
  const BeamSegment& segment = b.geometry.segments.at(0);
  const Section s = section_of(segment.start, segment.material.nu, b.geometry.shear);
  const eq14::Boom boom{segment.length, segment.material.rho * s.A, segment.material.E * s.Iz};
  const bool all = b.directions == "all";
  require(!all || b.modes % 2 == 0, fmt::format("body {}: eq. 14 has equal modes in two planes: with directions = "
                                                "\"all\" give an even number of modes, not {}",
                                                b.name, b.modes));
  const int per_plane = all ? b.modes / 2 : b.modes;
  PreparedBody r;
  r.body = eq14::reduced_body(boom, per_plane, all ? eq14::Planes::xy_and_xz : eq14::Planes::xy, b.name);
  apply_damping(r.body, b.damping);
  return r;
}

Mesh solid_mesh(const BodyScene& b, int refine) {
  SolidOptions own = b.solid;
  own.holds_tip = same_but_case(b.clamp, "tip");
  if (refine == 0) return make_solid_mesh(b.geometry, own);
  const std::optional<SolidOptions> options = refined(chosen(b.geometry, own), refine);
  require(options.has_value(), fmt::format("body {}: there is no coarser mesh of its elements", b.name));
  return make_solid_mesh(b.geometry, *options);
}

/// What a scene says of a basis, its shapes chosen by `modes` and `directions`.
BasisOptions basis_of(const BodyScene& b) {
  BasisOptions o = b.basis;
  o.modes = b.modes;
  o.in_plane = b.directions != "all";
  o.backend = b.backend;
  return o;
}

PreparedBody prepare_model(const BodyScene& b, int refine) {
  Model model;
  model.name = b.name;
  model.mesh = mesh_of(b, refine);
  model.clamp = node_set(model.mesh, b.clamp);
  ReductionOptions o;
  o.basis = basis_of(b);
  if (b.structure == "rigid") o.basis.modes = 0;
  o.stiffening = !b.stiffening.empty();
  o.damping = b.damping;
  o.certified = false;
  ReductionSeconds seconds;
  PreparedBody r = prepared(make_reduced_body(model, o, 1, seconds));
  r.elements = static_cast<int>(model.mesh.elements.size());
  r.notes = std::move(model.notes);
  if (b.structure == "rigid") r.body.structure = "rigid";
  return r;
}

/// A body with all its shapes. Whether the equations have its geometric stiffness does not change it.
std::string all_that_makes(BodyScene b, int refine) {
  b.shapes.clear();
  if (!b.stiffening.empty()) b.stiffening = "auto";
  return fmt::format("{}\nrefined {}\nflexboom {}\n", to_toml(b), refine, version);
}

/// Where a body is kept: its name, and a digest of all that it is made of.
std::filesystem::path kept_file(const BodyScene& b, int refine, const std::filesystem::path& keep) {
  return keep / fmt::format("{}-{}.h5", b.name, sha256(all_that_makes(b, refine)).substr(0, 16));
}

std::optional<PreparedBody> read_kept(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return {};
  try {
    PreparedBody p = prepared(read_body_file(file));
    p.kept = file;
    return p;
  } catch (const InputError&) {
    return {};  // cut off or changed: it is made anew
  }
}

/// Best effort: a folder that cannot be written costs the next run its time, not this one.
void write_kept(const std::filesystem::path& file, const PreparedBody& p) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  ReducedBody body = p.body;
  body.certificate = p.checks;
  try {
    write_body_file(file, body);
  } catch (const InputError&) {
    return;
  }
}

}  // namespace

BeamGeometry refined(BeamGeometry geometry, int steps) {
  if (geometry.order + steps <= highest_beam_order)
    geometry.order += steps;
  else
    for (BeamSegment& segment : geometry.segments) segment.elements = 2 * std::max(segment.elements, 8);
  return geometry;
}

Mesh mesh_of(const BodyScene& b, int refine) {
  return b.structure == "solid" ? solid_mesh(b, refine) : make_mesh(refined(b.geometry, refine));
}

bool is_bearable(const Mesh& mesh) {
  constexpr Eigen::Index most_unknowns = 140'000;  // of a solid: three per node
  return mesh.nodes.size() <= most_unknowns;
}

namespace {

PreparedBody with_all_shapes(const BodyScene& b, int refine, const std::filesystem::path& keep) {
  if (b.rigid) return prepare_rigid(b);
  if (b.reduced) return prepare_reduced(b, refine);
  require(b.structure == "eq14" || b.structure == "beam" || b.structure == "solid" || b.structure == "rigid",
          fmt::format("body {}: structure '{}' is not available; there are: 'beam', 'solid', 'eq14', 'rigid'", b.name,
                      b.structure));
  const std::filesystem::path file =
      b.structure == "solid" && !keep.empty() ? kept_file(b, refine, keep) : std::filesystem::path();
  if (!file.empty())
    if (std::optional<PreparedBody> kept = read_kept(file)) return kept->modes = b.modes, *std::move(kept);
  PreparedBody r = b.structure == "eq14" ? prepare_eq14(b) : prepare_model(b, refine);
  r.modes = b.modes;
  for (const BodyCheck& c : r.checks)
    if (!c.passed)
      throw NumericalError(fmt::format("body {}: invariant {} = {:.17g}, but {:.17g} by an independent route", b.name,
                                       c.name, c.value, c.reference));
  if (!file.empty()) write_kept(file, r), r.kept = file;
  return r;
}

/// What a unit of the load that a static shape is of does on every coordinate, n; empty where nobody knows the load.
VectorXd unit_load(const ReducedBody& body, const Coordinate& load) {
  constexpr std::string_view axes = "xyz";
  const auto at = std::ranges::find(body.markers, load.interface, &Marker::name);
  if (at == body.markers.end() || load.direction.size() != 2) return {};
  const auto axis = static_cast<Eigen::Index>(axes.find(load.direction[1]));
  const Eigen::Matrix3Xd& S = load.direction[0] == 'F' ? at->S : at->S_theta;
  return S.row(axis).transpose();
}

/// A body with the chosen modes and the static shapes. Of each static shape it has the deflection that the chosen modes
/// leave. The whole body has the rest of that deflection in modes that are not chosen. The coordinates of the result
/// are orthogonal, modes first.
ReducedBody with_chosen_modes(const ReducedBody& whole, const std::vector<int>& chosen, int modes) {
  const int statics = whole.n() - modes;
  MatrixXd rest(whole.n(), statics);
  const Eigen::LDLT<MatrixXd> stiffness(whole.Ke);
  for (int k = 0; k < statics; ++k) {
    const VectorXd load = unit_load(whole, whole.coordinates[static_cast<size_t>(modes) + static_cast<size_t>(k)]);
    if (load.size() == 0) {
      rest.col(k) = VectorXd::Unit(whole.n(), modes + k);
      continue;
    }
    rest.col(k) = stiffness.solve(load);
    rest(chosen, k).setZero();
    rest.col(k) /= std::sqrt(rest.col(k).dot(whole.Me * rest.col(k)));
  }
  std::vector<Coordinate> coordinates;
  MatrixXd T = MatrixXd::Zero(whole.n(), std::ssize(chosen) + statics);
  for (const int k : chosen) {
    T(k, std::ssize(coordinates)) = 1;
    coordinates.push_back(whole.coordinates[static_cast<size_t>(k)]);
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> ritz(rest.transpose() * whole.Ke * rest,
                                                                rest.transpose() * whole.Me * rest);
  T.rightCols(statics) = rest * ritz.eigenvectors();
  for (int k = 0; k < statics; ++k) {
    coordinates.push_back(whole.coordinates[static_cast<size_t>(modes) + static_cast<size_t>(k)]);
    coordinates.back().frequency_hz = std::sqrt(ritz.eigenvalues()[k]) / (2 * std::numbers::pi);
  }
  return combined(whole, T, std::move(coordinates));
}

PreparedBody with_shapes(PreparedBody p, const BodyScene& b) {
  if (b.shapes.empty() || b.structure == "rigid") return p;
  std::vector<int> list;
  for (const int k : b.shapes) list.push_back(k - 1);
  const int modes = p.coordinates_of_modes();
  p.body = p.body.n() > modes ? with_chosen_modes(p.body, list, modes) : selected(p.body, list);
  p.shapes = b.shapes;
  return p;
}

}  // namespace

int PreparedBody::coordinates_of_modes() const {
  return body.n() - static_cast<int>(std::ranges::count(body.coordinates, "attachment", &Coordinate::kind));
}

PreparedBody prepare_body(const BodyScene& b, int refine, const std::filesystem::path& keep) {
  return with_shapes(with_all_shapes(b, refine, keep), b);
}

PreparedBody PreparedBodies::get(const BodyScene& b, int refine, const std::filesystem::path& keep) {
  if (!b.is_boom()) return prepare_body(b, refine, keep);
  const std::lock_guard alone(guard_);
  constexpr size_t most = 200;  // bodies that vary are met once: what they take of the memory must end
  BodyScene unnamed = b;
  if (b.structure == "beam") unnamed.name.clear();  // solids are kept by their names
  const std::string made_of = all_that_makes(unnamed, refine);
  auto found = whole_.find(made_of);
  if (found == whole_.end()) {
    PreparedBody made = with_all_shapes(b, refine, keep);
    if (whole_.size() >= most) whole_.clear();
    found = whole_.emplace(made_of, std::move(made)).first;
  }
  PreparedBody p = with_shapes(found->second, b);
  p.body.name = b.name;
  return p;
}

}  // namespace flexboom
