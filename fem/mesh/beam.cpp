#include "fem/mesh/beam.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/shape_pairs.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom::beam {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;

bool has_shear(const BeamProperty& property) { return property.theory == BeamTheory::timoshenko; }

// Element axes (columns of A_ME: x along the beam, y from the property, z = x cross y) and geometry.
struct Frame {
  Matrix3d A_ME;
  Vector3d origin;
  double length;
};

Frame frame_of(const Mesh& mesh, const Element& element) {
  const Vector3d start = mesh.nodes.col(element.nodes[0]);
  const Vector3d axis = mesh.nodes.col(element.nodes[1]) - start;
  const double length = axis.norm();
  const Vector3d x = axis / length;
  const Vector3d& y_axis = mesh.beam_properties[static_cast<size_t>(element.property)].y_axis;
  const Vector3d y = (y_axis - x * x.dot(y_axis)).normalized();
  Matrix3d A_ME;
  A_ME << x, y, x.cross(y);
  return {A_ME, start, length};
}

// Legendre polynomials P_0 .. P_degree at xi.
VectorXd legendre(int degree, double xi) {
  VectorXd P(std::max(degree, 1) + 1);
  P(0) = 1;
  P(1) = xi;
  for (int k = 1; k < degree; ++k) P(k + 1) = ((2 * k + 1) * xi * P(k) - k * P(k - 1)) / (k + 1);
  return P;
}

// Normalised Legendre polynomial and its first and second integrals that vanish at both ends (the second with its
// slope). c_k = sqrt(k + 1/2) makes the integral of (c_k P_k)^2 over [-1, 1] one.
double unit_legendre(const VectorXd& P, int k) { return std::sqrt(k + 0.5) * P(k); }
double bubble(const VectorXd& P, int k) { return std::sqrt(k + 0.5) * (P(k + 1) - P(k - 1)) / (2 * k + 1); }
double smooth_bubble(const VectorXd& P, int k) {
  return std::sqrt(k + 0.5) * ((P(k + 2) - P(k)) / (2 * k + 3) - (P(k) - P(k - 2)) / (2 * k - 1)) / (2 * k + 1);
}

// A bar (axial or torsion): freedoms [u1, u2, p bubbles], value and strain u' at one point.
struct BarShapes {
  VectorXd u, strain;
};

BarShapes bar_shapes(int p, double xi, double h) {
  const VectorXd P = legendre(p + 1, xi);
  BarShapes bar{VectorXd(p + 2), VectorXd(p + 2)};
  bar.u.head(2) << (1 - xi) / 2, (1 + xi) / 2;
  bar.strain.head(2) << -1 / h, 1 / h;
  for (int k = 1; k <= p; ++k) {
    bar.u(k + 1) = bubble(P, k);
    bar.strain(k + 1) = 2 / h * unit_legendre(P, k);
  }
  return bar;
}

// Bending in one plane: freedoms [w1, theta1, w2, theta2, internal], theta = w' without shear.
struct BendingShapes {
  VectorXd w, theta, curvature, shear;  // curvature theta' [1/m], shear strain w' - theta
};

int bending_internal(int p, bool with_shear) { return (p - 1) + (with_shear ? p + 2 : 0); }

// Cubic Hermite polynomials on the nodes: no shear, so both theories share them.
void set_hermite(BendingShapes& b, double xi, double h) {
  const double m = 1 - xi, q = 1 + xi;
  b.w.head(4) << m * m * (2 + xi) / 4, h * m * m * q / 8, q * q * (2 - xi) / 4, -h * q * q * m / 8;
  b.theta.head(4) << -1.5 * m * q / h, -m * (1 + 3 * xi) / 4, 1.5 * m * q / h, -q * (1 - 3 * xi) / 4;
  b.curvature.head(4) << 6 * xi / (h * h), (3 * xi - 1) / h, -6 * xi / (h * h), (3 * xi + 1) / h;
}

// Pure shear strain P_0 .. P_{p+1}, with w and theta zero at the nodes. All but the first have theta = 0.
void set_shear(BendingShapes& b, int first, const VectorXd& P, int p, double xi, double h) {
  const double c = std::sqrt(0.5);
  b.w(first) = c * (xi * xi - 1) * xi / 2;
  b.theta(first) = 3 * c / h * (xi * xi - 1);
  b.curvature(first) = 12 * c * xi / (h * h);
  b.shear(first) = 2 * c / h;
  for (int k = 1; k <= p + 1; ++k) {
    b.w(first + k) = bubble(P, k);
    b.shear(first + k) = 2 / h * unit_legendre(P, k);
  }
}

BendingShapes bending_shapes(int p, bool with_shear, double xi, double h) {
  const int n = 4 + bending_internal(p, with_shear);
  BendingShapes b{VectorXd::Zero(n), VectorXd::Zero(n), VectorXd::Zero(n), VectorXd::Zero(n)};
  const VectorXd P = legendre(p + 2, xi);
  set_hermite(b, xi, h);
  for (int k = 2; k <= p; ++k) {  // bending without shear: curvature P_k
    b.w(k + 2) = smooth_bubble(P, k);
    b.theta(k + 2) = 2 / h * bubble(P, k);
    b.curvature(k + 2) = 4 / (h * h) * unit_legendre(P, k);
  }
  if (with_shear) set_shear(b, p + 3, P, p, xi, h);
  return b;
}

// Writes a row over element freedoms: node values to the given columns, internal ones from column `internal` on.
template <int nodal>
void set_row(Matrix6X& rows, Index row, const std::array<Index, nodal>& columns, Index internal,
             const VectorXd& values) {
  for (size_t i = 0; i < nodal; ++i) rows(row, columns[i]) = values(static_cast<Index>(i));
  const Index count = values.size() - nodal;
  rows.row(row).segment(internal, count) = values.tail(count).transpose();
}

// Rows in element axes over node freedoms in element axes and internal freedoms.
struct LocalRows {
  Matrix6X motion;  // ux uy uz, theta x y z
  Matrix6X strain;  // axial, shear y, shear z, twist, curvature y, curvature z
};

LocalRows local_rows(int p, bool with_shear, double xi, double h) {
  const BarShapes bar = bar_shapes(p, xi, h);
  const BendingShapes bend = bending_shapes(p, with_shear, xi, h);
  const int nb = bending_internal(p, with_shear);
  const Index axial = 12, torsion = 12 + p, plane_y = 12 + 2 * p, plane_z = plane_y + nb;
  LocalRows r{Matrix6X::Zero(6, plane_z + nb), Matrix6X::Zero(6, plane_z + nb)};

  set_row<2>(r.motion, 0, {0, 6}, axial, bar.u);
  set_row<2>(r.motion, 3, {3, 9}, torsion, bar.u);
  set_row<4>(r.motion, 1, {1, 5, 7, 11}, plane_y, bend.w);
  set_row<4>(r.motion, 5, {1, 5, 7, 11}, plane_y, bend.theta);
  set_row<4>(r.motion, 2, {2, 4, 8, 10}, plane_z, bend.w);
  set_row<4>(r.motion, 4, {2, 4, 8, 10}, plane_z, -bend.theta);

  set_row<2>(r.strain, 0, {0, 6}, axial, bar.strain);
  set_row<4>(r.strain, 1, {1, 5, 7, 11}, plane_y, bend.shear);
  set_row<4>(r.strain, 2, {2, 4, 8, 10}, plane_z, bend.shear);
  set_row<2>(r.strain, 3, {3, 9}, torsion, bar.strain);
  set_row<4>(r.strain, 4, {2, 4, 8, 10}, plane_z, -bend.curvature);
  set_row<4>(r.strain, 5, {1, 5, 7, 11}, plane_y, bend.curvature);

  // The shapes of the plane x-z belong to w' = -theta_y: the node freedom theta_y enters with its sign changed.
  for (Index column : {4, 10}) {
    r.motion.col(column) *= -1;
    r.strain.col(column) *= -1;
  }
  return r;
}

// Columns of node freedoms from element to mesh axes.
void rotate_node_columns(Matrix6X& rows, const Matrix3d& A_ME) {
  for (Index c = 0; c < 12; c += 3) rows.middleCols<3>(c) = (rows.middleCols<3>(c) * A_ME.transpose()).eval();
}

Matrix6X motion_rows(const Frame& frame, int p, bool with_shear, double xi) {
  Matrix6X motion = local_rows(p, with_shear, xi, frame.length).motion;
  rotate_node_columns(motion, frame.A_ME);
  motion.topRows<3>() = (frame.A_ME * motion.topRows<3>()).eval();
  motion.bottomRows<3>() = (frame.A_ME * motion.bottomRows<3>()).eval();
  return motion;
}

// Exact for mass and stiffness of a tapered round bar or rectangle: shapes of degree p + 2 squared times A (degree 2),
// and of degree p + 1 squared times I (degree 4), are 2 p + 6 <= 2 n - 1.
int gauss_points(int p) { return p + 4; }
// The torsion constant and shear coefficient of other tapers are not polynomials: more points bring them to round-off.
constexpr int taper_points = 6;

Section section_at(const BeamProperty& property, double s) {
  const ShearRule rule = has_shear(property) ? property.shear : ShearRule{"value", 1};
  return section_of(interpolate(property.start, property.end, s), property.material.nu, rule);
}

VectorXd rigidities(const BeamProperty& property, const Section& s) {
  const double E = property.material.E, G = property.material.shear_modulus();
  VectorXd D(has_shear(property) ? 6 : 4);
  if (has_shear(property)) {
    D << E * s.A, s.kappa_y * G * s.A, s.kappa_z * G * s.A, G * s.J, E * s.Iy, E * s.Iz;
  } else {
    D << E * s.A, G * s.J, E * s.Iy, E * s.Iz;
  }
  return D;
}

// What second-order strains are made of, in element axes: rows over the columns of q.
struct Slopes {
  MatrixXd theta;   // 3 x k
  MatrixXd strain;  // 6 x k: rows of LocalRows::strain
};

Slopes slopes_at(const Frame& frame, int p, bool with_shear, double xi, const Eigen::Ref<const MatrixXd>& q) {
  LocalRows rows = local_rows(p, with_shear, xi, frame.length);
  rotate_node_columns(rows.motion, frame.A_ME);
  rotate_node_columns(rows.strain, frame.A_ME);
  return {rows.motion.bottomRows<3>() * q, rows.strain * q};
}

// Second-order strains that the resultants N, Qy, Qz, T, My, Mz work on: columns, pairs x 6. U = N (v'^2 + w'^2 +
// Ip/A theta_x'^2) / 2 + Qy (w' theta_x + theta_x theta_y / 2) + Qz (-v' theta_x + theta_x theta_z / 2)
// - M . (theta x theta') / 2.
MatrixXd second_order(const Slopes& s, double polar) {
  const auto x = s.theta.row(0), y = s.theta.row(1), z = s.theta.row(2);
  const auto dx = s.strain.row(3), dy = s.strain.row(4), dz = s.strain.row(5);
  const VectorXd dv = (s.strain.row(1) + z).transpose(), dw = (s.strain.row(2) - y).transpose();
  MatrixXd pairs = MatrixXd::Zero(number_of_pairs(x.size()), 6);
  add_pairs(pairs.col(0), 0.5, dv.transpose(), dv.transpose());
  add_pairs(pairs.col(0), 0.5, dw.transpose(), dw.transpose());
  add_pairs(pairs.col(0), 0.5 * polar, dx, dx);
  add_pairs(pairs.col(1), 1, dw.transpose(), x);
  add_pairs(pairs.col(1), 0.5, x, y);
  add_pairs(pairs.col(2), -1, dv.transpose(), x);
  add_pairs(pairs.col(2), 0.5, x, z);
  add_pairs(pairs.col(3), -0.5, y, dz);
  add_pairs(pairs.col(3), 0.5, z, dy);
  add_pairs(pairs.col(4), -0.5, z, dx);
  add_pairs(pairs.col(4), 0.5, x, dz);
  add_pairs(pairs.col(5), -0.5, x, dy);
  add_pairs(pairs.col(5), 0.5, y, dx);
  return pairs;
}

// Without shear strain the shear forces are Qy = -Mz', Qz = My', and U has -Qy theta_x theta_y / 2 - Qz theta_x theta_z
// / 2. Integrated by parts: the moments work on these derivatives inside the element, and at its ends.
void add_shear_forces_inside(const Slopes& s, MatrixXd& pairs) {
  const auto x = s.theta.row(0), y = s.theta.row(1), z = s.theta.row(2);
  const auto dx = s.strain.row(3), dy = s.strain.row(4), dz = s.strain.row(5);
  add_pairs(pairs.col(4), 0.5, dx, z);
  add_pairs(pairs.col(4), 0.5, x, dz);
  add_pairs(pairs.col(5), -0.5, dx, y);
  add_pairs(pairs.col(5), -0.5, x, dy);
}
MatrixXd shear_forces_at_end(const Slopes& s) {
  const Index k = s.theta.cols();
  MatrixXd pairs = MatrixXd::Zero(k * (k + 1) / 2, 6);
  add_pairs(pairs.col(4), -0.5, s.theta.row(0), s.theta.row(2));
  add_pairs(pairs.col(5), 0.5, s.theta.row(0), s.theta.row(1));
  return pairs;
}

// N, Qy, Qz, T, My, Mz of strains (6 x k); without shear strain the shear forces are zero here.
MatrixXd resultants(const BeamProperty& property, const Section& s, const MatrixXd& strain) {
  const double E = property.material.E, G = property.material.shear_modulus();
  Eigen::Matrix<double, 6, 1> D;
  D << E * s.A, s.kappa_y * G * s.A, s.kappa_z * G * s.A, G * s.J, E * s.Iy, E * s.Iz;
  return D.asDiagonal() * strain;
}

const BeamProperty& property_of(const Mesh& mesh, const Element& element) {
  return mesh.beam_properties[static_cast<size_t>(element.property)];
}

}  // namespace

int internal_freedoms(const Mesh& mesh, const Element& element) {
  return 2 * element.order + 2 * bending_internal(element.order, has_shear(property_of(mesh, element)));
}

void strain_points(const Mesh& mesh, const Element& element, const StrainPointVisitor& visit) {
  const BeamProperty& property = property_of(mesh, element);
  const bool with_shear = has_shear(property);
  const Frame frame = frame_of(mesh, element);
  const GaussRule& rule = gauss_rule(gauss_points(element.order) + taper_points);
  for (Index g = 0; g < rule.points.size(); ++g) {
    Matrix6X strain = local_rows(element.order, with_shear, rule.points(g), frame.length).strain;
    rotate_node_columns(strain, frame.A_ME);
    MatrixXd B = strain;
    if (!with_shear) B = strain({0, 3, 4, 5}, Eigen::all);
    const Section section = section_at(property, (1 + rule.points(g)) / 2);
    visit(rule.weights(g) * frame.length / 2, B, rigidities(property, section).asDiagonal().toDenseMatrix());
  }
}

MatrixXd energy_strains(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q) {
  MatrixXd strains(q.cols(), 0);
  strain_points(mesh, element, [&](double weight, const MatrixXd& B, const MatrixXd& D) {
    const VectorXd root = (weight * D.diagonal()).cwiseSqrt();  // D is diagonal
    strains.conservativeResize(Eigen::NoChange, strains.cols() + B.rows());
    strains.rightCols(B.rows()) = (root.asDiagonal() * (B * q)).transpose();
  });
  return strains;
}

void mass_points(const Mesh& mesh, const Element& element, int extra, const MassPointVisitor& visit) {
  const BeamProperty& property = property_of(mesh, element);
  const Frame frame = frame_of(mesh, element);
  const GaussRule& rule = gauss_rule(gauss_points(element.order) + extra);
  for (Index g = 0; g < rule.points.size(); ++g) {
    const double s = (1 + rule.points(g)) / 2;
    const Section section = section_at(property, s);
    const double dm = property.material.rho * section.A * rule.weights(g) * frame.length / 2;
    const double on_axis = property.line_mass * rule.weights(g) * frame.length / 2;
    const Matrix6X motion = motion_rows(frame, element.order, has_shear(property), rule.points(g));
    const Vector3d centre = frame.origin + s * frame.length * frame.A_ME.col(0);
    if (!property.rotary_inertia) {
      visit(dm + on_axis, centre, motion.topRows<3>());
      continue;
    }
    if (on_axis > 0) visit(on_axis, centre, motion.topRows<3>());
    // u = u_c + theta x r with r = (0, +-sqrt(Iz/A), +-sqrt(Iy/A)) in element axes.
    const double y = std::sqrt(section.Iz / section.A), z = std::sqrt(section.Iy / section.A);
    for (const Vector3d& r_E : {Vector3d(0, y, z), Vector3d(0, -y, -z), Vector3d(0, y, -z), Vector3d(0, -y, z)}) {
      const Vector3d r = frame.A_ME * r_E;
      Eigen::Matrix3Xd N = motion.topRows<3>();
      for (Index c = 0; c < N.cols(); ++c) N.col(c) += motion.col(c).tail<3>().cross(r);
      visit(dm / 4, centre + r, N);
    }
  }
}

void add_prestress_work(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q0,
                        const Eigen::Ref<const MatrixXd>& q, Eigen::Ref<MatrixXd> work) {
  const BeamProperty& property = property_of(mesh, element);
  const bool with_shear = has_shear(property);
  const Frame frame = frame_of(mesh, element);
  const auto resultants_at = [&](double xi, const Section& section) {
    return resultants(property, section, slopes_at(frame, element.order, with_shear, xi, q0).strain);
  };
  const GaussRule& rule = gauss_rule(gauss_points(element.order) + taper_points);
  for (Index g = 0; g < rule.points.size(); ++g) {
    const double xi = rule.points(g);
    const Section section = section_at(property, (1 + xi) / 2);
    const Slopes slopes = slopes_at(frame, element.order, with_shear, xi, q);
    MatrixXd pairs = second_order(slopes, (section.Iy + section.Iz) / section.A);
    if (!with_shear) add_shear_forces_inside(slopes, pairs);
    work.noalias() += rule.weights(g) * frame.length / 2 * (pairs * resultants_at(xi, section));
  }
  if (with_shear) return;
  for (const double end : {-1.0, 1.0}) {
    const Slopes slopes = slopes_at(frame, element.order, with_shear, end, q);
    work.noalias() += end * (shear_forces_at_end(slopes) * resultants_at(end, section_at(property, (1 + end) / 2)));
  }
}

Matrix6X interpolation(const Mesh& mesh, const Element& element, const Vector3d& at) {
  return motion_rows(frame_of(mesh, element), element.order, has_shear(property_of(mesh, element)), 2 * at(0) - 1);
}

Vector3d position(const Mesh& mesh, const Element& element, const Vector3d& at) {
  return (1 - at(0)) * mesh.nodes.col(element.nodes[0]) + at(0) * mesh.nodes.col(element.nodes[1]);
}

void validate(const Mesh& mesh, const Element& element) {
  constexpr int max_order = 12;
  require(element.order >= 1 && element.order <= max_order,
          fmt::format("order is {}; it must be 1 to {}", element.order, max_order));
  require(element.property >= 0 && element.property < static_cast<int>(mesh.beam_properties.size()),
          fmt::format("beam property {} is missing; the mesh has {}", element.property, mesh.beam_properties.size()));
  const BeamProperty& property = mesh.beam_properties[static_cast<size_t>(element.property)];
  const bool sheared = property.theory == BeamTheory::timoshenko;
  require(element.type == element_type(sheared ? "beam-timoshenko" : "beam-euler-bernoulli"),
          fmt::format("type \"{}\" does not agree with the theory of its property", type_of(element).name));
  const Vector3d axis = mesh.nodes.col(element.nodes[1]) - mesh.nodes.col(element.nodes[0]);
  require(axis.norm() > 0, "beam of zero length");
  require(axis.normalized().cross(property.y_axis.normalized()).norm() > 1e-6,
          "the y axis of the section is parallel to the beam");
  require(property.rotary_inertia || (axis.array() != 0).count() == 1,
          "a beam without rotary inertia must run along an axis of the mesh (its torsion has no mass)");
}

}  // namespace flexboom::beam
