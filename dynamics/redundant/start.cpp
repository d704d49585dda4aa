#include "dynamics/redundant/start.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/scratch.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <algorithm>

namespace flexboom::redundant {

using Eigen::Index;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/// Independent rows have pivots of the order of the mechanism's angles, dependent ones of round-off.
constexpr double rank_tolerance = 1e-9;

/// Columns D^-1/2 G^T of the rows, each of length 1.
MatrixXd scaled_columns(Equations& e, double t, const double* y) {
  MatrixXd B = e.inverse_metric().cwiseSqrt().asDiagonal() * e.gradient(t, y).transpose();
  for (Index i = 0; i < B.cols(); ++i) {
    const double size = B.col(i).norm();
    if (size > 0) B.col(i) /= size;
  }
  return B;
}

std::vector<Index> kept_rows(const Equations& e) {
  std::vector<Index> rows;
  Index row = 0;
  for (const JointData& j : e.joints())
    for (const Row& r : j.rows) {
      if (r.kept) rows.push_back(row);
      ++row;
    }
  return rows;
}

MatrixXd kept_gradient(Equations& e, double t, const double* y) { return e.gradient(t, y)(kept_rows(e), Eigen::all); }

/// Block diagonal, over the freedoms of all bodies.
MatrixXd mass_matrix(const Equations& e, const double* y) {
  MatrixXd M = MatrixXd::Zero(e.freedoms(), e.freedoms());
  for (size_t i = 0; i < e.places().size(); ++i) {
    const BodyPlaces& at = e.places()[i];
    M.block(at.freedom, at.freedom, 6 + at.n, 6 + at.n) = e.mass(i, y);
  }
  return M;
}

}  // namespace

std::vector<RowName> row_names(const Equations& e) {
  std::vector<RowName> names;
  for (size_t j = 0; j < e.joints().size(); ++j)
    for (size_t r = 0; r < e.joints()[j].rows.size(); ++r) names.push_back({j, r});
  return names;
}

std::string describe(const Equations& e, RowName n) {
  if (e.joints().empty()) return "no joint";
  return fmt::format("joint \"{}\": {}", e.scene().joints[n.joint].name, e.joints()[n.joint].rows[n.row].what);
}

RankReport constraint_rank(Equations& e, double t, const double* y) {
  RankReport report;
  report.gap = 0;
  const MatrixXd B = scaled_columns(e, t, y);
  report.kept.assign(static_cast<size_t>(B.cols()), 1);
  if (B.cols() == 0) return report;
  // The tree's rows first, then what they leave of the loops': a row that is too many is a loop's where it can be.
  const std::vector<RowName> names = row_names(e);
  MatrixXd Q(B.rows(), 0);
  double largest = 0, smallest = 1;
  for (const bool loops : {false, true}) {
    std::vector<Index> group;
    for (Index i = 0; i < B.cols(); ++i)
      if (e.scene().joints[names[static_cast<size_t>(i)].joint].closes_loop == loops) group.push_back(i);
    if (group.empty()) continue;
    MatrixXd rest = B(Eigen::all, group);
    for (int twice = 0; twice < 2; ++twice) rest -= Q * (Q.transpose() * rest).eval();
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(rest);
    const Index pivots = std::min(rest.rows(), rest.cols());
    Index rank = 0;
    for (Index k = 0; k < static_cast<Index>(group.size()); ++k) {
      const double pivot = k < pivots ? std::abs(qr.matrixR()(k, k)) : 0;
      const Index row = group[static_cast<size_t>(qr.colsPermutation().indices()[k])];
      if (pivot > rank_tolerance) {
        largest = std::max(largest, pivot), smallest = std::min(smallest, pivot);
        ++rank;
      } else {
        report.kept[static_cast<size_t>(row)] = 0;
        report.gap = std::max(report.gap, pivot);
      }
    }
    MatrixXd all(B.rows(), Q.cols() + rank);
    all << Q, MatrixXd(qr.householderQ() * MatrixXd::Identity(B.rows(), rank));
    Q = std::move(all);
  }
  report.margin = largest > 0 ? smallest / largest : 1;
  for (size_t i = 0; i < names.size(); ++i)
    if (const JointData& j = e.joints()[names[i].joint]; !report.kept[i] && j.is_there(j.rows[names[i].row]))
      report.left_out.push_back(names[i]);
  return report;
}

std::string body_without_inertia(Equations& e, double t, const double* y) {
  constexpr double enough = 1e-12;  // of the largest, in freedoms scaled to be alike
  const Index n = e.freedoms();
  if (n == 0 || !Map<const VectorXd>(y, e.size()).allFinite()) return "";
  const VectorXd root = e.inverse_metric().cwiseSqrt();
  const MatrixXd rows = root.asDiagonal() * kept_gradient(e, t, y).transpose();
  MatrixXd free = MatrixXd::Identity(n, n);
  if (rows.cols() > 0) free = Eigen::ColPivHouseholderQR<MatrixXd>(rows).householderQ() * free;
  free = (root.asDiagonal() * free.rightCols(n - rows.cols())).eval();
  if (free.cols() == 0) return "";
  const Eigen::SelfAdjointEigenSolver<MatrixXd> inertia(MatrixXd(free.transpose() * mass_matrix(e, y) * free));
  const VectorXd& of = inertia.eigenvalues();
  if (of(0) > enough * of(of.size() - 1)) return "";
  const VectorXd motion = (free * inertia.eigenvectors().col(0)).cwiseQuotient(root);
  const auto share = [&](const BodyPlaces& at) { return motion.segment(at.freedom, 6 + at.n).norm(); };
  const auto most = std::ranges::max_element(e.places(), {}, share);
  const ReducedBody& body = e.scene().bodies[static_cast<size_t>(most - e.places().begin())];
  return fmt::format(
      "the mass matrix of body {} is not positive definite in a motion that the joints leave free: too "
      "little inertia to compute with; give it inertia there, or fewer modes",
      body.name);
}

std::string locked_joint(Equations& e, double t, const double* y) {
  const std::vector<Index> kept = kept_rows(e);
  const MatrixXd B = scaled_columns(e, t, y)(Eigen::all, kept);
  const Eigen::JacobiSVD<MatrixXd> svd(B, Eigen::ComputeThinV);
  const VectorXd weights = svd.matrixV().rightCols(1);
  const std::vector<RowName> names = row_names(e);
  std::vector<double> share(e.joints().size(), 0.0);
  for (size_t i = 0; i < kept.size(); ++i)
    share[names[static_cast<size_t>(kept[i])].joint] += weights[static_cast<Index>(i)] * weights[static_cast<Index>(i)];
  size_t worst = 0;
  double most = -1;
  for (size_t j = 0; j < share.size(); ++j) {
    const double weight = share[j] * (e.scene().joints[j].closes_loop ? 1e3 : 1.0);
    if (weight > most) most = weight, worst = j;
  }
  return e.scene().joints[worst].name;
}

Violation violation(const Equations& e, const VectorXd& values) {
  Violation v;
  Index i = 0;
  for (size_t j = 0; j < e.joints().size(); ++j)
    for (size_t r = 0; r < e.joints()[j].rows.size(); ++r, ++i) {
      const bool along = e.joints()[j].rows[r].kind == Row::Kind::along;
      double& size = along ? v.position : v.angle;
      if (!(std::abs(values[i]) > size)) continue;
      size = std::abs(values[i]);
      (along ? v.worst_position : v.worst_angle) = {j, r};
    }
  return v;
}

void check_branches(Equations& e, double t, const double* y) {
  for (size_t i = 0; i < e.joints().size(); ++i) {
    const JointData& j = e.joints()[i];
    const Joint& joint = e.scene().joints[i];
    const PairMotion<double> x = e.pair(j, t, y, &joint);
    const JoinedPlaces<double> at(j, x);
    const bool parallel =
        joint.kind == JointKind::hinge || joint.kind == JointKind::slider || joint.kind == JointKind::fixed;
    if (parallel)
      require(dot(transposed(at.a.axes).row[2], transposed(at.b.axes).row[2]) > 0,
              fmt::format("joint \"{}\": the z axes of its places are opposite, they must agree", joint.name));
    double turn = 0;
    if (joint.kind == JointKind::hinge && !joint.prescribed.empty()) turn = x.drive[0].value;
    if (joint.kind == JointKind::slider || joint.kind == JointKind::fixed ||
        (joint.kind == JointKind::hinge && !joint.prescribed.empty())) {
      const double angle = joint_gap(true, turn, at, 0).value + turn;
      require(std::abs(angle - turn) < 1,
              fmt::format("joint \"{}\": b is turned by {:.3g} rad about z against a, must be {:.3g}", joint.name,
                          angle, turn));
    }
  }
}

void Equations::displace(VectorXd& y, const VectorXd& dx) const {
  for (const BodyPlaces& at : places_) {
    const Vector3d turn = dx.segment<3>(at.freedom + 3);
    const double angle = turn.norm();
    Vector4d step;
    step[0] = std::cos(angle / 2);
    step.tail<3>() = turn * (angle > 1e-8 ? std::sin(angle / 2) / angle : 0.5);
    y.segment<3>(at.R) += dx.segment<3>(at.freedom);
    y.segment<4>(at.p) = quaternion_product(y.segment<4>(at.p), step).normalized();
    y.segment(at.q, at.n) += dx.segment(at.freedom + 6, at.n);
  }
}

void Equations::accelerate(VectorXd& y, const VectorXd& dv) const {
  for (const BodyPlaces& at : places_) y.segment(at.v, 6 + at.n) += dv.segment(at.freedom, 6 + at.n);
}

double Equations::project(double t, VectorXd& y) {
  const std::vector<Index> kept = kept_rows(*this);
  for (const BodyPlaces& at : places_) y.segment<4>(at.p).normalize();
  if (kept.empty()) return 0;
  RowValues values;
  const VectorXd root = inverse_metric_.cwiseSqrt();
  const auto solve = [&](const VectorXd& against) {  // least D^1/2 x with G x = - against
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(
        MatrixXd(root.asDiagonal() * kept_gradient(*this, t, y.data()).transpose()));
    const Index rank = qr.cols();
    VectorXd z = qr.colsPermutation().transpose() * VectorXd(-against);
    z = qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().transpose().solve(z);
    VectorXd full = VectorXd::Zero(freedoms_);
    full.head(rank) = z;
    return VectorXd(root.cwiseProduct(VectorXd(qr.householderQ() * full)));
  };
  double last = 1e300, moved = 0;
  for (int round = 0; round < 50; ++round) {
    row_values(t, y.data(), values);
    const VectorXd dx = solve(values.g(kept));
    const double size = dx.cwiseAbs().maxCoeff();
    if (!std::isfinite(size) || size > 10) break;
    if (round == 0) moved = size;
    if (size < 1e-15 || (size < 1e-11 && size > 0.3 * last)) break;  // round-off
    displace(y, dx);
    last = size;
  }
  row_values(t, y.data(), values);
  const VectorXd dv = solve(values.g_dot(kept));
  if (dv.allFinite()) accelerate(y, dv);
  return moved;
}

void Equations::make_consistent(double t, VectorXd& y, VectorXd& y_dot, const JointMemory& memory) {
  const std::vector<Index> kept = kept_rows(*this);
  const Index m = static_cast<Index>(kept.size()), n = freedoms_;
  y.segment(motion_, work_ - motion_).setZero();
  y_dot = VectorXd::Zero(size_);
  VectorXd F(size_);
  residual(t, y.data(), y_dot.data(), memory, F.data());
  MatrixXd K = MatrixXd::Zero(n + m, n + m);
  VectorXd b(n + m), scale(n + m);
  scale.head(n) = inverse_metric_.cwiseSqrt();
  K.topLeftCorner(n, n) = mass_matrix(*this, y.data());
  for (const BodyPlaces& at : places_) b.segment(at.freedom, 6 + at.n) = -F.segment(at.v, 6 + at.n);
  if (m > 0) {
    RowValues values;
    row_values(t, y.data(), values);
    const MatrixXd G = kept_gradient(*this, t, y.data());
    K.bottomLeftCorner(m, n) = G;
    K.topRightCorner(n, m) = -G.transpose();
    b.tail(m) = -values.bias(kept);
    scale.tail(m) = (G * scale.head(n).asDiagonal()).rowwise().norm().cwiseInverse();
  }
  K = scale.asDiagonal() * K * scale.asDiagonal();
  const Eigen::PartialPivLU<MatrixXd> lu(K);
  VectorXd x = lu.solve(VectorXd(scale.cwiseProduct(b)));
  x += lu.solve(VectorXd(scale.cwiseProduct(b) - K * x));
  x = scale.cwiseProduct(x);
  if (!x.allFinite() || lu.rcond() < 1e-14) {
    const std::string body = body_without_inertia(*this, t, y.data());
    if (!body.empty()) throw NumericalError(fmt::format("t = {:.9g} s: {}", t, body));
  }
  if (!x.allFinite())
    throw NumericalError(fmt::format("at t = {:.9g} s the accelerations are not determined: dependent constraints", t));
  for (const BodyPlaces& at : places_) {
    y_dot.segment(at.v, 6 + at.n) = x.segment(at.freedom, 6 + at.n);
    y_dot.segment(at.R, 3) = y.segment<3>(at.v);
    const std::array<double, 4> turn = half_product(y.data() + at.p, three(y.data() + at.w));
    for (int k = 0; k < 4; ++k) y_dot[at.p + k] = turn[static_cast<size_t>(k)];
    y_dot.segment(at.q, at.n) = y.segment(at.u, at.n);
  }
  Index row = n;
  for (const JointData& j : joints_)
    for (const Row& r : j.rows)
      if (r.kept) y[r.lambda] = x[row++];
  residual(t, y.data(), y_dot.data(), memory, F.data());  // what is left: rates of the wheels and of the energies
  for (size_t i = 0; i < scene_.wheels.size(); ++i) y_dot[wheel(i)] = -F[wheel(i)];
  for (int energy = work_; energy < size_; ++energy) y_dot[energy] = -F[energy];
}

}  // namespace flexboom::redundant
