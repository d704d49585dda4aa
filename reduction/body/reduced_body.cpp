#include "reduction/body/reduced_body.hpp"

#include "fem/base/check.hpp"
#include "fem/base/round_off.hpp"
#include "reduction/body/diagonal.hpp"
#include "reduction/body/rigid_motion.hpp"
#include "reduction/body/tilde.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace flexboom {
namespace {

/// Round-off allowed in a quantity built from sums over many points.

class Checker {
 public:
  explicit Checker(const ReducedBody& body) : body_(body) {}

  void check(bool condition, const std::string& field, const std::string& fault) const {
    require(condition, "body \"" + body_.name + "\": " + field + " " + fault);
  }

  template <class Derived>
  void shape(const Eigen::MatrixBase<Derived>& A, Eigen::Index rows, Eigen::Index cols,
             const std::string& field) const {
    check(A.rows() == rows && A.cols() == cols, field,
          "is " + std::to_string(A.rows()) + " x " + std::to_string(A.cols()) + ", must be " + std::to_string(rows) +
              " x " + std::to_string(cols));
    check(A.allFinite(), field, "has entries that are not finite");
  }

  void count(size_t size, Eigen::Index n, const std::string& field) const {
    check(static_cast<Eigen::Index>(size) == n, field,
          "has " + std::to_string(size) + " entries, must have " + std::to_string(n) + " (one per coordinate)");
  }

  void symmetric(const Eigen::MatrixXd& A, const std::string& field) const {
    check((A - A.transpose()).norm() <= relative_round_off * A.norm(), field, "must be symmetric");
  }

 private:
  const ReducedBody& body_;
};

void validate_rigid_part(const ReducedBody& body, const Checker& c) {
  c.check(std::isfinite(body.m) && body.m > 0, "m", "must be positive, is " + std::to_string(body.m));
  c.shape(body.mc0, 3, 1, "mc0");
  c.shape(body.J0, 3, 3, "J0");
  c.symmetric(body.J0, "J0");
  // Principal moments about the mass centre: not negative, and none greater than the sum of the others (a line mass has
  // equality).
  const Eigen::Matrix3d about_centre = body.J0 - centre_inertia(body.m, body.mc0);
  const Eigen::Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(about_centre, Eigen::EigenvaluesOnly).eigenvalues();
  const double slack = relative_round_off * body.J0.norm();
  c.check(principal(0) >= -slack, "J0",
          "is not an inertia: negative principal moment about the mass centre " + std::to_string(principal(0)));
  c.check(principal(2) <= principal(0) + principal(1) + slack, "J0",
          "is not an inertia: a principal moment exceeds the sum of the other two (triangle inequality)");
}

void validate_flexible_part(const ReducedBody& body, const Checker& c) {
  const int n = body.n();
  c.shape(body.Me, n, n, "Me");
  c.shape(body.Ke, n, n, "Ke");
  c.shape(body.De, n, n, "De");
  c.symmetric(body.Me, "Me");
  c.symmetric(body.Ke, "Ke");
  c.shape(body.Ct, 3, n, "Ct");
  c.shape(body.Cr0, 3, n, "Cr0");
  c.count(body.Cr1.size(), n, "Cr1");
  c.count(body.J1.size(), n, "J1");
  c.count(body.J2.size(), n, "J2");
  c.count(body.coordinates.size(), n, "coordinates");
  for (size_t k = 0; k < body.Cr1.size(); ++k) {
    const std::string index = fmt::format("[{}]", k);
    c.shape(body.Cr1[k], 3, n, "Cr1" + index);
    c.shape(body.J1[k], 3, 3, "J1" + index);
    c.count(body.J2[k].size(), n, "J2" + index);
    for (const Eigen::Matrix3d& J : body.J2[k]) c.shape(J, 3, 3, "J2" + index);
  }
  if (body.gram.size() > 0) {
    c.shape(body.gram, 4 + 3 * n, 4 + 3 * n, "gram");
    c.symmetric(body.gram, "gram");
  }
  c.check(n == 0 || Eigen::LLT<Eigen::MatrixXd>(body.Me).info() == Eigen::Success, "Me", "must be positive definite");
}

/// Names of markers or interfaces, none of them twice.
template <class Named>
void validate_names(const std::vector<Named>& things, const std::string& field, const Checker& c) {
  std::set<std::string> names;
  for (const Named& thing : things) c.check(names.insert(thing.name).second, field, "has \"" + thing.name + "\" twice");
}

void validate_points(const ReducedBody& body, const Checker& c) {
  validate_names(body.markers, "markers", c);
  for (const Marker& marker : body.markers) {
    c.shape(marker.position, 3, 1, "marker \"" + marker.name + "\" position");
    c.shape(marker.S, 3, body.n(), "marker \"" + marker.name + "\" S");
    c.shape(marker.S_theta, 3, body.n(), "marker \"" + marker.name + "\" S_theta");
  }
  c.check(body.display.S.size() == static_cast<size_t>(body.display.points.cols()), "display.S",
          "must have one entry per point");
  for (const Eigen::Matrix3Xd& S : body.display.S) c.shape(S, 3, body.n(), "display.S");
}

void validate_interfaces(const ReducedBody& body, const Checker& c) {
  validate_names(body.interfaces, "interfaces", c);
  for (const Interface& i : body.interfaces) {
    const auto count = static_cast<int>(std::ranges::count(i.components, true));
    const int first = i.first_coordinate;
    c.check(first == -1 || (first >= 0 && first + count <= body.n()), "interface \"" + i.name + "\"",
            "has " + std::to_string(count) + " coordinates from " + std::to_string(first) + ", the body has " +
                std::to_string(body.n()));
  }
}

void validate_stiffening(const ReducedBody& body, const Checker& c) {
  const auto family = [&](const std::vector<Eigen::MatrixXd>& matrices, size_t count, const std::string& field) {
    c.check(matrices.empty() || matrices.size() == count, field,
            "has " + std::to_string(matrices.size()) + " matrices, must have " + std::to_string(count) + " or none");
    for (const Eigen::MatrixXd& A : matrices) c.shape(A, body.n(), body.n(), field);
  };
  family(body.Kg.spin, 6, "Kg.spin");
  family(body.Kg.acceleration, 3, "Kg.acceleration");
  family(body.Kg.angular_acceleration, 3, "Kg.angular_acceleration");
  for (const MarkerStiffness& at : body.Kg.markers) {
    const std::string where = "Kg of marker \"" + at.marker + "\"";
    c.check(std::ranges::find(body.markers, at.marker, &Marker::name) != body.markers.end(), where,
            "is of a marker that the body does not have");
    family(at.force, 3, where + " force");
    family(at.torque, 3, where + " torque");
  }
}

/// -sum dm (tilde(a) tilde(b) + tilde(b) tilde(a)) / 2 = tr W I - sym W of W = sum dm a b^T.
Eigen::Matrix3d inertia_of(const Eigen::Matrix3d& W) {
  return W.trace() * Eigen::Matrix3d::Identity() - (W + W.transpose()) / 2;
}

/// De that damps every mode phi of (Ke, Me) by 2 zeta omega. It is the sum over modes of 2 zeta omega Me phi phi^T Me,
/// with phi^T Me phi = 1. See Clough and Penzien, Dynamics of Structures, on proportional damping matrices.
Eigen::MatrixXd modal_damping(const ReducedBody& body, double zeta) {
  if (is_diagonal(body.Ke) && is_diagonal(body.Me)) {
    const Eigen::ArrayXd stiffness = body.Ke.diagonal().array().max(0.0);
    return (2 * zeta * (stiffness * body.Me.diagonal().array()).sqrt()).matrix().asDiagonal();
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(body.Ke, body.Me);
  const Eigen::VectorXd omega = modes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd momenta = body.Me * modes.eigenvectors();
  const Eigen::MatrixXd D = momenta * (2 * zeta * omega).asDiagonal() * momenta.transpose();
  return (D + D.transpose()) / 2;
}

}  // namespace

double ReducedBody::frequency(Eigen::Index k) const { return std::sqrt(std::max(Ke(k, k), 0.0) / Me(k, k)); }

void ReducedBody::validate() const {
  const Checker c(*this);
  validate_rigid_part(*this, c);
  validate_flexible_part(*this, c);
  validate_points(*this, c);
  validate_interfaces(*this, c);
  validate_stiffening(*this, c);
}

ReducedBody blank_body(std::string name, int n) {
  ReducedBody body;
  body.name = std::move(name);
  body.Ct = body.Cr0 = Eigen::Matrix3Xd::Zero(3, n);
  body.Me = body.Ke = body.De = Eigen::MatrixXd::Zero(n, n);
  body.Cr1.assign(static_cast<size_t>(n), body.Ct);
  body.J1.assign(static_cast<size_t>(n), Eigen::Matrix3d::Zero());
  body.J2.assign(static_cast<size_t>(n), body.J1);
  return body;
}

void set_invariants(ReducedBody& body, Eigen::MatrixXd gram) {
  const Eigen::Index n = body.n();
  require(gram.rows() == 4 + 3 * n && gram.cols() == 4 + 3 * n,
          "body \"" + body.name + "\": gram must have " + std::to_string(4 + 3 * n) + " rows and columns");
  const auto block = [](Eigen::Index k) { return 4 + 3 * k; };
  body.m = gram(0, 0);
  body.mc0 = gram.block<3, 1>(1, 0);
  body.J0 = inertia_of(gram.block<3, 3>(1, 1));
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    const Eigen::Matrix3d u0_S = gram.block<3, 3>(1, block(k));
    body.Ct.col(k) = gram.block<3, 1>(block(k), 0);
    body.Cr0.col(k) = axial(u0_S);
    body.J1[kk] = 2 * inertia_of(u0_S);
    for (Eigen::Index l = 0; l < n; ++l) {
      const Eigen::Matrix3d S_S = gram.block<3, 3>(block(k), block(l));
      body.Me(k, l) = S_S.trace();
      body.Cr1[kk].col(l) = axial(S_S);
      body.J2[kk][static_cast<size_t>(l)] = inertia_of(S_S);
    }
  }
  body.gram = std::move(gram);
}

Eigen::Matrix3d centre_inertia(double m, const Eigen::Vector3d& mc0) {
  return (mc0.squaredNorm() * Eigen::Matrix3d::Identity() - mc0 * mc0.transpose()) / m;
}

ReducedBody rigid_body(std::string name, double m, const Eigen::Vector3d& mc0, const Eigen::Matrix3d& J0) {
  ReducedBody body = blank_body(std::move(name), 0);
  body.structure = "rigid";
  body.m = m;
  body.mc0 = mc0;
  body.J0 = J0;
  body.gram.resize(4, 4);  // J0 = tr W I - W with W the second moments, so W = tr J0 / 2 I - J0
  body.gram << m, mc0.transpose(), mc0, J0.trace() / 2 * Eigen::Matrix3d::Identity() - J0;
  body.validate();
  return body;
}

const Marker& marker(const ReducedBody& body, const std::string& name) {
  std::string known;
  for (const Marker& m : body.markers) {
    if (m.name == name) return m;
    known += (known.empty() ? "\"" : ", \"") + m.name + "\"";
  }
  throw InputError("body \"" + body.name + "\": no marker \"" + name + "\"; it has " +
                   (known.empty() ? "none" : known));
}

namespace {

/// What the rigid motions that a free body's own coordinates hold have of Me: L^T M_r^-1 L, L the rows of Ct and Cr0.
/// Nothing damps them.
Eigen::MatrixXd rigid_part_of_Me(const ReducedBody& body) {
  if (body.frame != "free") return Eigen::MatrixXd::Zero(body.n(), body.n());
  const Eigen::MatrixXd L = rigid_coupling(body);
  const Eigen::MatrixXd part = L.transpose() * rigid_mass(body).completeOrthogonalDecomposition().solve(L);
  return 0.5 * (part + part.transpose());
}

}  // namespace

void apply_damping(ReducedBody& body, const DampingRule& rule) {
  const std::string where = "body \"" + body.name + "\": damping";
  for (const double value : {rule.value, rule.alpha, rule.beta}) {
    require(std::isfinite(value) && value >= 0, fmt::format("{} must not be negative, got {}", where, value));
  }
  if (rule.name == "none") {
    body.De.setZero(body.n(), body.n());
  } else if (rule.name == "modal" || rule.name == "loss-factor") {
    // A loss factor eta damps a resonance as zeta = eta / 2.
    body.De = modal_damping(body, rule.name == "modal" ? rule.value : rule.value / 2);
  } else if (rule.name == "rayleigh") {
    body.De = rule.alpha * (body.Me - rigid_part_of_Me(body)) + rule.beta * body.Ke;
  } else {
    throw InputError(where + " rule \"" + rule.name +
                     R"(" is unknown; there are "none", "modal", "loss-factor", "rayleigh")");
  }
}

}  // namespace flexboom
