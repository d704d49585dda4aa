#include "reduction/invariants/uniform_beam.hpp"

#include "fem/mesh/element.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double mesh_error = 1e-3;  // above it the mesh does not resolve its modes

/// w and theta = c(s) w of exp(s x) (README, "Uniform beams"): s^4 + (g + h) s^2 + g h - b4 = 0 has the roots
/// +-lambda, +-i mu. Scaled by powers of mu, so that all entries are of order 1 at any frequency.
class Waves {
 public:
  /// nothing: lambda is not real, the frequency is above the cutoff.
  static std::optional<Waves> at(const BendingBeam& beam, double omega) {
    const double squared = omega * omega, g = beam.rho_A * squared * beam.compliance,
                 h = beam.rho_I * squared / beam.EI, b4 = beam.rho_A * squared / beam.EI;
    const double root = std::sqrt((g - h) * (g - h) / 4 + b4), mu2 = root + (g + h) / 2;
    const double lambda2 = (b4 - g * h) / mu2;  // root - (g + h) / 2 without cancellation
    if (!(lambda2 > 0)) return {};
    return Waves(beam, std::sqrt(lambda2), std::sqrt(mu2), g, h);
  }

  /// Rows of exp(-lambda x), exp(lambda (x - L)), cos mu x, sin mu x at x.
  Vector4d w(double x) const { return {std::exp(-lambda_ * x), std::exp(lambda_ * (x - L_)), c(x), s(x)}; }
  Vector4d theta(double x) const { return slopes(x, 0); }
  Vector4d curvature(double x) const { return slopes(x, 1); }
  /// -Q / EI = theta'' + h theta.
  Vector4d shear(double x) const { return slopes(x, 2) + h_ * slopes(x, 0); }

  /// w(0) = theta(0) = 0, theta'(L) = Q(L) = 0.
  Matrix4d conditions() const {
    Matrix4d A;
    A << w(0).transpose(), theta(0).transpose() / mu_, curvature(L_).transpose() / (mu_ * mu_),
        shear(L_).transpose() / (mu_ * mu_ * mu_);
    return A;
  }

 private:
  Waves(const BendingBeam& beam, double lambda, double mu, double g, double h)
      : L_(beam.L),
        lambda_(lambda),
        mu_(mu),
        decay_((lambda * lambda + g) / lambda),
        turn_((mu * mu - g) / mu),
        h_(h) {}

  double c(double x) const { return std::cos(mu_ * x); }
  double s(double x) const { return std::sin(mu_ * x); }

  /// d^k theta / dx^k, k = 0, 1, 2.
  Vector4d slopes(double x, int k) const {
    const double up = decay_ * std::pow(lambda_, k), down = -decay_ * std::pow(-lambda_, k),
                 t = turn_ * std::pow(mu_, k);
    const Vector4d wave = w(x);
    const std::array<double, 2> harmonic = k == 0   ? std::array{-s(x), c(x)}
                                           : k == 1 ? std::array{-c(x), -s(x)}
                                                    : std::array{s(x), -c(x)};
    return {down * wave(0), up * wave(1), t * harmonic[0], t * harmonic[1]};
  }

  double L_, lambda_, mu_, decay_, turn_, h_;
};

/// A clamped uniform beam of a mesh.
struct Found {
  int root = 0, tip = 0;
  BeamProperty property;
  Section section;
  Vector3d axis;  // root to tip
  double L = 0;
};

bool same(double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); }

bool same(const Section& a, const Section& b) {
  return same(a.A, b.A) && same(a.Iy, b.Iy) && same(a.Iz, b.Iz) && same(a.J, b.J) && same(a.kappa_y, b.kappa_y) &&
         same(a.kappa_z, b.kappa_z);
}

/// Whether all elements have the material, section and theory of the first.
bool uniform(const Mesh& mesh, const BeamProperty& p, const Section& s) {
  return std::ranges::all_of(mesh.elements, [&](const Element& e) {
    const BeamProperty& q = mesh.beam_properties[static_cast<size_t>(e.property)];
    return q.theory == p.theory && q.rotary_inertia == p.rotary_inertia && q.material.E == p.material.E &&
           q.material.nu == p.material.nu && q.material.rho == p.material.rho && q.line_mass == p.line_mass &&
           (q.y_axis - p.y_axis).norm() < 1e-12 && same(section_of(q.start, q.material.nu, q.shear), s) &&
           same(section_of(q.end, q.material.nu, q.shear), s);
  });
}

/// The beam, or why there is none.
std::string find_beam(const Mesh& mesh, const Clamp& clamp, Found& found) {
  if (std::ranges::any_of(mesh.elements, [](const Element& e) { return type_of(e).shape != Shape::line; }))
    return "not of beams alone";
  if (!mesh.bodies.empty()) return "bodies on its nodes";
  if (!mesh.rigid_connections.empty() || !mesh.distributing_connections.empty() || !mesh.equations.empty() ||
      !mesh.supports.empty())
    return "supports or connections";
  if (clamp.nodes.size() != 1) return "not clamped at one node";
  found.root = clamp.nodes.front();
  const Vector3d root = mesh.nodes.col(found.root);
  (mesh.nodes.colwise() - root).colwise().norm().maxCoeff(&found.tip);
  const Vector3d span = mesh.nodes.col(found.tip) - root;
  found.L = span.norm();
  found.axis = span / found.L;
  // A straight chain from the clamp on: its elements point along the axis and add up to its length.
  double sum = 0;
  for (const Element& e : mesh.elements) {
    const Vector3d d = mesh.nodes.col(e.nodes[1]) - mesh.nodes.col(e.nodes[0]);
    if (!same(std::abs(d.dot(found.axis)), d.norm())) return "not straight, or not clamped at its end";
    sum += d.norm();
  }
  if (std::abs(sum - found.L) > 1e-9 * found.L) return "not one chain clamped at its end";
  found.property = mesh.beam_properties[static_cast<size_t>(mesh.elements.front().property)];
  found.section = section_of(found.property.start, found.property.material.nu, found.property.shear);
  return uniform(mesh, found.property, found.section) ? "" : "not uniform";
}

/// omega, Ct and Cr0 (about the BRF origin).
struct ExactMode {
  double omega;
  Vector3d Ct, Cr0;
};

/// sin(kappa x) / sin(kappa L) with the k that is the nearest: frequency, and the integral over x.
std::pair<double, double> standing_wave(double L, double speed, double near) {
  const double k = std::max(1.0, std::round(near * L / speed / std::numbers::pi + 0.5));
  const double kappa = (2 * k - 1) * std::numbers::pi / (2 * L);
  return {kappa * speed, 1 / (kappa * std::sin(kappa * L))};
}

/// The closed form of a mode with that motion of the tip.
std::optional<ExactMode> exact_mode(const Found& f, const Vector3d& root, const Vector3d& u, const Vector3d& theta,
                                    double near) {
  const Section& s = f.section;
  const Material& material = f.property.material;
  const double rho_A = material.rho * s.A + f.property.line_mass;
  const double along = u.dot(f.axis), twist = theta.dot(f.axis) * f.L, across = (u - along * f.axis).norm();
  if (std::abs(along) > std::max(across, std::abs(twist))) {
    const auto [omega, integral] = standing_wave(f.L, std::sqrt(material.E * s.A / rho_A), near);
    const Vector3d Ct = rho_A * integral * along * f.axis;
    return ExactMode{omega, Ct, root.cross(Ct)};
  }
  const double Ip = s.Iy + s.Iz;
  if (std::abs(twist) > across) {
    const auto [omega, integral] =
        standing_wave(f.L, std::sqrt(material.shear_modulus() * s.J / (material.rho * Ip)), near);
    return ExactMode{omega, Vector3d::Zero(), material.rho * Ip * integral * twist / f.L * f.axis};
  }
  const Vector3d direction = (u - along * f.axis) / across;
  const Vector3d y = (f.property.y_axis - f.property.y_axis.dot(f.axis) * f.axis).normalized();
  const double in_y = std::abs(direction.dot(y));
  if (!same(s.Iy, s.Iz) && std::min(in_y, std::abs(1 - in_y)) > 1e-6) return {};  // not in a principal plane
  const bool plane_y = in_y > 0.5;
  const double I = plane_y ? s.Iz : s.Iy, kappa = plane_y ? s.kappa_y : s.kappa_z;
  const bool sheared = f.property.theory == BeamTheory::timoshenko;
  const std::optional<BendingMode> mode =
      bending_mode({f.L, rho_A, material.E * I, f.property.rotary_inertia ? material.rho * I : 0,
                    sheared ? 1 / (kappa * material.shear_modulus() * s.A) : 0},
                   near);
  if (!mode) return {};
  const Vector3d Ct = mode->Ct * across * direction;
  return ExactMode{mode->omega, Ct, root.cross(Ct) + mode->Cr0 * across * f.axis.cross(direction)};
}

/// Lowest frequency [rad/s] above which bending has two waves instead of one.
double cutoff(const Found& f) {
  const Section& s = f.section;
  if (f.property.theory != BeamTheory::timoshenko || !f.property.rotary_inertia)
    return std::numeric_limits<double>::infinity();
  const double G_rho = f.property.material.shear_modulus() / f.property.material.rho;
  return std::sqrt(G_rho * s.A * std::min(s.kappa_y / s.Iz, s.kappa_z / s.Iy));
}

/// The worst of many errors.
struct Worst {
  BodyCheck check;

  explicit Worst(const std::string& name) : check{"closed form of a uniform beam: " + name, 0, 0, 0, true} {}

  void add(double value, double reference, double error) {
    if (error < check.relative_error) return;
    check = {check.name, value, reference, error, error <= mesh_error};
  }
};

}  // namespace

std::optional<BendingMode> bending_mode(const BendingBeam& beam, double near) {
  const auto determinant = [&beam](double omega) {
    const std::optional<Waves> waves = Waves::at(beam, omega);
    return waves ? waves->conditions().determinant() : std::numeric_limits<double>::quiet_NaN();
  };
  for (const double share : {1e-6, 1e-4, 2e-2}) {
    double low = near * (1 - share), high = near * (1 + share);
    double D_low = determinant(low);
    if (!(D_low * determinant(high) <= 0)) continue;
    for (double middle = (low + high) / 2; low < middle && middle < high; middle = (low + high) / 2) {
      const double D = determinant(middle);
      (D * D_low > 0 ? low : high) = middle;
    }
    const Waves waves = *Waves::at(beam, low);
    const Eigen::JacobiSVD<Matrix4d> svd(waves.conditions(), Eigen::ComputeFullV);
    const Vector4d x = svd.matrixV().col(3) / svd.matrixV().col(3).dot(waves.w(beam.L));
    // What holds the root is what moves the beam: omega^2 Ct = Q(0), omega^2 Cr0 = M(0).
    const double scale = beam.EI / (low * low);
    return BendingMode{low, -scale * waves.shear(0).dot(x), scale * waves.curvature(0).dot(x)};
  }
  return {};
}

std::vector<BodyCheck> check_uniform_beam(const ReducedBody& body, const Mesh& mesh, const DofMap& dofs,
                                          const Clamp& clamp, const ModalBasis& basis) {
  Found f;
  std::string reason = find_beam(mesh, clamp, f);
  // Ritz modes in a span of shapes have no proof of completeness: their frequencies lie above those of the body.
  const bool modes = body.frame == "clamped" && !basis.summary.proof.empty() &&
                     std::ranges::all_of(body.coordinates,
                                         [](const Coordinate& c) { return c.interface.empty() && c.frequency_hz > 0; });
  if (!modes) reason = "coordinates that are no modes of a clamped body";
  if (!reason.empty()) return {{"closed form of a uniform beam: not applicable, " + reason, 0, 0, 0, true}};
  Worst frequency("frequency, worst of all modes"), Ct("Ct"), Cr0("Cr0");
  double missing = 0;
  for (Index k = 0; k < body.n(); ++k) {
    const auto motion = basis.Phi.col(k).segment<6>(dofs.of_node(f.tip, 0));
    const double omega = 2 * std::numbers::pi * body.coordinates[static_cast<size_t>(k)].frequency_hz;
    const auto exact = exact_mode(f, mesh.nodes.col(f.root), motion.head<3>(), motion.tail<3>(), omega);
    if (!exact) {
      if (omega < cutoff(f)) ++missing;
      continue;
    }
    frequency.add(omega, exact->omega, std::abs(omega / exact->omega - 1));
    const double Me = body.Me(k, k);
    Ct.add(body.Ct.col(k).norm(), exact->Ct.norm(), (body.Ct.col(k) - exact->Ct).norm() / std::sqrt(body.m * Me));
    Cr0.add(body.Cr0.col(k).norm(), exact->Cr0.norm(),
            (body.Cr0.col(k) - exact->Cr0).norm() / std::sqrt(body.J0.trace() * Me));
  }
  return {frequency.check,
          Ct.check,
          Cr0.check,
          {"closed form of a uniform beam: modes below the cutoff that have none", missing, 0, missing, missing == 0}};
}

}  // namespace flexboom
