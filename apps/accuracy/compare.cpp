#include "apps/accuracy/compare.hpp"

#include "apps/accuracy/run_scene.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "reduction/invariants/eq14.hpp"
#include "reduction/invariants/inertia_invariants.hpp"

#include <fmt/format.h>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

BodyScene with_model(BodyScene b, BeamTheory theory, bool rotary_inertia) {
  b.structure = "beam";
  b.directions = "hinge-plane";
  b.shapes.clear();
  b.basis = {};
  b.geometry.theory = theory;
  b.geometry.rotary_inertia = rotary_inertia;
  return b;
}

eq14::Boom uniform_boom(const BodyScene& b) {
  const BeamGeometry& g = b.geometry;
  require(g.segments.size() == 1 && g.attachments.empty(),
          fmt::format("body {}: eq. 14 is a uniform boom: one segment without attachments", b.name));
  require(b.clamp == "root", fmt::format("body {}: eq. 14 is clamped at its root, not at '{}'", b.name, b.clamp));
  const BeamSegment& s = g.segments.front();
  const Section start = section_of(s.start, s.material.nu, g.shear), end = section_of(s.end, s.material.nu, g.shear);
  require(start.A == end.A && start.Iz == end.Iz, fmt::format("body {}: eq. 14 is a uniform boom: no taper", b.name));
  return {s.length, s.material.rho * start.A, s.material.E * start.Iz};
}

/// Cosines of FE shapes with eq. 14 shapes in the M inner product, both normalised; the mass points carry the integral.
double subspace_error(const Mesh& mesh, const Assembly& assembly, const ModalBasis& basis, double length) {
  constexpr int finer = 12;  // points above the rule for the polynomials: eq. 14 is not one
  const Eigen::Index n = basis.Phi.cols();
  MatrixXd cross = MatrixXd::Zero(n, n), own = MatrixXd::Zero(n, n), closed = MatrixXd::Zero(n, n);
  for_each_mass_point(
      mesh, assembly.dofs,
      [&](double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>& N,
          std::span<const int> dofs) {
        MatrixXd q(static_cast<Eigen::Index>(dofs.size()), n);
        for (size_t i = 0; i < dofs.size(); ++i) q.row(static_cast<Eigen::Index>(i)) = basis.Phi.row(dofs[i]);
        const MatrixXd u = N * q;
        VectorXd phi(n);
        for (Eigen::Index k = 0; k < n; ++k) phi[k] = eq14::phi(static_cast<int>(k) + 1, u0.x() / length);
        cross += dm * u.row(1).transpose() * phi.transpose();
        own += dm * u.transpose() * u;
        closed += dm * phi * phi.transpose();
      },
      finer);
  const VectorXd a = own.diagonal().cwiseSqrt().cwiseInverse(), b = closed.diagonal().cwiseSqrt().cwiseInverse();
  const VectorXd cosines = (a.asDiagonal() * cross * b.asDiagonal()).eval().jacobiSvd().singularValues();
  return std::abs(1 - cosines.minCoeff());
}

/// @throws InputError, NumericalError where the elements are too few for so many modes.
OrderComparison compare_order(BodyScene b, const eq14::Boom& boom, int order, int count, int elements) {
  const Stopwatch start;
  b.geometry.order = order;
  for (BeamSegment& s : b.geometry.segments) s.elements = elements;
  const Mesh mesh = make_mesh(b.geometry);
  const std::vector<int>& clamp = node_set(mesh, b.clamp);
  const Assembly assembly = assemble(mesh);
  EigenOptions options;
  options.backend = b.backend;
  const ModalBasis basis = clamped_modes_of_kind(mesh, assembly, clamp, count, {ModeKind::bending_y}, options);
  const ReducedBody body = reduce(mesh, assembly, basis, b.name);
  OrderComparison r;
  r.seconds = start.seconds();
  r.order = order;
  r.dofs = basis.unknowns;
  const double m = boom.mass_per_length * boom.length;
  for (int k = 1; k <= count; ++k) {
    const double omega = eq14::omega(boom, k), sign = eq14::phi(k, 1.0) > 0 ? 1 : -1;
    const double Ct = m * sign * eq14::integral_phi(k), Cr = m * boom.length * sign * eq14::integral_x_phi(k);
    r.frequency = std::max(r.frequency, std::abs(basis.omega[k - 1] / omega - 1));
    r.Ct = std::max(r.Ct, std::abs(body.Ct(1, k - 1) / Ct - 1));
    r.Cr = std::max(r.Cr, std::abs(body.Cr0(2, k - 1) / Cr - 1));
  }
  r.subspace = subspace_error(mesh, assembly, basis, boom.length);
  return r;
}

VectorXd frequencies_hz(const BodyScene& b, int count, int elements) {
  BodyScene fine = b;
  for (BeamSegment& s : fine.geometry.segments) s.elements = std::max({elements, s.elements, count});
  fine.modes = count;
  fine.geometry.order = 8;
  VectorXd hz(count);
  const PreparedBody p = prepare_body(fine);
  for (int k = 0; k < count; ++k) hz[k] = p.body.coordinates[static_cast<size_t>(k)].frequency_hz;
  return hz;
}

}  // namespace

std::string not_comparable(const BodyScene& b) {
  if (!b.is_boom() || !b.is_flexible()) return fmt::format("body {}: it is no flexible boom", b.name);
  try {
    uniform_boom(b);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

BodyComparison compare_with_eq14(const BodyScene& b, int count, int elements) {
  const eq14::Boom boom = uniform_boom(b);
  BodyComparison r{b.name, {}, {}};
  constexpr int highest = 8;
  for (int order = 1; order <= highest; ++order) {
    try {
      r.orders.push_back(
          compare_order(with_model(b, BeamTheory::euler_bernoulli, false), boom, order, count, elements));
    } catch (const std::runtime_error&) {  // low orders have fewer modes, and no solver finds nearly all of a mesh
      if (order == highest) throw;
    }
  }
  const VectorXd rotary = frequencies_hz(with_model(b, BeamTheory::euler_bernoulli, true), count, elements);
  const VectorXd shear = frequencies_hz(with_model(b, BeamTheory::timoshenko, true), count, elements);
  for (int k = 1; k <= count; ++k)
    r.modes.push_back({eq14::omega(boom, k) / (2 * std::numbers::pi), rotary[k - 1], shear[k - 1]});
  return r;
}

std::vector<TransientComparison> compare_transients(const Scene& given) {
  Scene scene = given;
  scene.error_budget = false;
  const auto fly = [&](const std::string& structure, BeamTheory theory, bool rotary) {
    for (BodyScene& b : scene.bodies) {
      if (!b.stiffening.empty()) b.stiffening = "off";
      if (!not_comparable(b).empty()) continue;
      b = with_model(b, theory, rotary);
      b.structure = structure;
      b.stiffening.clear();  // eq. 14 has none, not even the foreshortening of the tip
    }
    return run_scene(scene, {}).outputs;
  };
  const OutputTable reference = fly("eq14", BeamTheory::euler_bernoulli, false);
  std::vector<TransientComparison> all;
  all.push_back({"Euler-Bernoulli elements, line mass",
                 compare_outputs(fly("beam", BeamTheory::euler_bernoulli, false), reference, {})});
  all.push_back({"+ rotary inertia", compare_outputs(fly("beam", BeamTheory::euler_bernoulli, true), reference, {})});
  all.push_back({"+ shear (Timoshenko)", compare_outputs(fly("beam", BeamTheory::timoshenko, true), reference, {})});
  return all;
}

}  // namespace flexboom
