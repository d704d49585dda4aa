#include "reduction/basis/mode_selection.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/interface_nodes.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The largest shares first until their sum reaches what is wanted; false: it does not.
bool take_largest(const VectorXd& share, double wanted, std::set<int>& taken) {
  std::vector<int> order(static_cast<size_t>(share.size()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater<>(), [&share](int k) { return share(k); });
  double sum = 0;
  for (const int k : order) {
    if (sum >= wanted) return true;
    sum += share(k);
    taken.insert(k);
  }
  return sum >= wanted;
}

void require_fraction(double fraction) {
  require(fraction > 0 && fraction <= 1, fmt::format("modes: the fraction must be in (0, 1], is {}", fraction));
}

}  // namespace

std::vector<int> modes_in_band(const ReducedBody& body, double low_hz, double high_hz) {
  require(low_hz <= high_hz, fmt::format("modes: the band from {} Hz to {} Hz is empty", low_hz, high_hz));
  std::vector<int> chosen;
  for (int k = 0; k < body.n(); ++k) {
    const double hz = body.coordinates[static_cast<size_t>(k)].frequency_hz;
    if (hz >= low_hz && hz <= high_hz) chosen.push_back(k);
  }
  return chosen;
}

std::vector<int> listed_modes(const ReducedBody& body, std::vector<int> list) {
  std::ranges::sort(list);
  for (size_t i = 0; i < list.size(); ++i) {
    require(list[i] >= 0 && list[i] < body.n(),
            fmt::format("modes: {} is not a coordinate; there are 1 to {}", list[i] + 1, body.n()));
    require(i == 0 || list[i] != list[i - 1], fmt::format("modes: {} is given twice", list[i] + 1));
  }
  return list;
}

ReducedBody combined(const ReducedBody& body, const MatrixXd& T, std::vector<Coordinate> coordinates) {
  require(T.rows() == body.n() && T.cols() == std::ssize(coordinates),
          fmt::format("modes: {} x {} combinations of {} coordinates, {} names", T.rows(), T.cols(), body.n(),
                      coordinates.size()));
  require(body.gram.size() > 0, "modes: body \"" + body.name + "\" has no gram to choose coordinates from");
  ReducedBody result = body;
  const auto combine = [&T](std::vector<MatrixXd>& matrices) {
    for (MatrixXd& A : matrices) A = (T.transpose() * A * T).eval();
  };
  const auto combine_columns = [&T](Eigen::Matrix3Xd& S) { S = (S * T).eval(); };
  MatrixXd Z = MatrixXd::Zero(4 + 3 * T.rows(), 4 + 3 * T.cols());  // of the columns of gram
  Z.topLeftCorner<4, 4>().setIdentity();
  for (Index k = 0; k < T.rows(); ++k)
    for (Index l = 0; l < T.cols(); ++l) Z.block<3, 3>(4 + 3 * k, 4 + 3 * l).diagonal().setConstant(T(k, l));
  ReducedBody blank = blank_body(body.name, static_cast<int>(T.cols()));
  set_invariants(blank, Z.transpose() * body.gram * Z);
  result.Ct = blank.Ct, result.Cr0 = blank.Cr0, result.Me = blank.Me, result.gram = blank.gram;
  result.Cr1 = std::move(blank.Cr1), result.J1 = std::move(blank.J1), result.J2 = std::move(blank.J2);
  result.Ke = T.transpose() * body.Ke * T;
  result.De = T.transpose() * body.De * T;
  for (auto* loads : {&result.Kg.spin, &result.Kg.acceleration, &result.Kg.angular_acceleration}) combine(*loads);
  for (MarkerStiffness& at : result.Kg.markers) combine(at.force), combine(at.torque);
  for (Marker& at : result.markers) combine_columns(at.S), combine_columns(at.S_theta);
  std::ranges::for_each(result.display.S, combine_columns);
  std::ranges::for_each(result.display.S_theta, combine_columns);
  result.coordinates = std::move(coordinates);
  result.interfaces.clear();
  result.certificate.clear();
  return result;
}

ReducedBody selected(const ReducedBody& body, const std::vector<int>& list) {
  MatrixXd T = MatrixXd::Zero(body.n(), std::ssize(list));
  std::vector<Coordinate> coordinates;
  for (const int k : list) {
    require(k >= 0 && k < body.n(), fmt::format("modes: coordinate {} chosen of a body of {}", k, body.n()));
    T(k, std::ssize(coordinates)) = 1;
    coordinates.push_back(body.coordinates[static_cast<size_t>(k)]);
  }
  ReducedBody result = combined(body, T, std::move(coordinates));
  result.interfaces = body.interfaces;
  for (Interface& at : result.interfaces) renumber(at, list);
  return result;
}

MatrixXd effective_masses(const ReducedBody& body) {
  return rigid_coupling(body).cwiseAbs2() * body.Me.diagonal().cwiseInverse().asDiagonal();
}

std::vector<int> modes_by_effective_mass(const ReducedBody& body, double fraction, const std::vector<int>& directions) {
  require_fraction(fraction);
  const MatrixXd effective = effective_masses(body);
  const MatrixXd M_r = rigid_mass(body);
  std::set<int> taken;
  for (const int d : directions) {
    require(d >= 0 && d < 6, fmt::format("modes: direction {} does not exist; there are 0 to 5", d));
    const VectorXd share = effective.row(d).transpose() / M_r(d, d);
    require(take_largest(share, fraction, taken),
            fmt::format("modes: all {} together have {:.6g} of the mass along {}, {} "
                        "wanted; make more modes",
                        body.n(), share.sum(), motion_name(d), fraction));
  }
  return {taken.begin(), taken.end()};
}

VectorXd completeness_indices(const ReducedBody& body) {
  // Rotations scaled to the body, and the directions that have inertia.
  MatrixXd M_r = rigid_mass(body);
  Eigen::Vector<double, 6> scale;
  scale << Eigen::Vector3d::Ones(), Eigen::Vector3d::Constant(std::sqrt(body.m / body.J0.trace()));
  M_r = scale.asDiagonal() * M_r * scale.asDiagonal();
  const MatrixXd L = scale.asDiagonal() * rigid_coupling(body);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(M_r);
  VectorXd index = VectorXd::Zero(body.n());
  int motions = 0;
  for (int i = 0; i < 6; ++i) {
    if (solver.eigenvalues()(i) < 1e-12 * body.m) continue;
    ++motions;
    index += (L.transpose() * solver.eigenvectors().col(i)).cwiseAbs2() / solver.eigenvalues()(i);
  }
  return index.cwiseQuotient(body.Me.diagonal()) / motions;
}

std::vector<int> modes_by_completeness(const ReducedBody& body, double fraction) {
  require_fraction(fraction);
  const VectorXd index = completeness_indices(body);
  std::set<int> taken;
  require(take_largest(index, fraction, taken),
          fmt::format("modes: all {} together are complete to {:.6g}, {} wanted; make more modes", body.n(),
                      index.sum(), fraction));
  return {taken.begin(), taken.end()};
}

MatrixXd observabilities(const ReducedBody& body, const std::vector<ObservedOutput>& outputs) {
  constexpr double negligible = 1e-10;  // round-off of a mode, against what its mass and the body's speak of
  MatrixXd share(std::ssize(outputs), body.n());
  for (size_t i = 0; i < outputs.size(); ++i) {
    const Marker& seen = marker(body, outputs[i].marker);
    const int component = component_of(outputs[i].direction);
    const VectorXd S = component < 3 ? seen.S.row(component) : seen.S_theta.row(component - 3);
    const double length = std::sqrt(body.J0.trace() / body.m);
    const double seen_at_all = component < 3 ? negligible : negligible / length;
    auto row = share.row(static_cast<Index>(i));
    for (int k = 0; k < body.n(); ++k) {
      const double omega = body.frequency(k);
      row(k) = S(k) * S(k) / (body.Me(k, k) * omega * omega * omega);
      if (std::abs(S(k)) <= seen_at_all * std::sqrt(body.Me(k, k) / body.m)) row(k) = 0;
    }
    const double largest = row.maxCoeff();
    for (int k = 0; k < body.n(); ++k) row(k) = std::isinf(largest) ? double(std::isinf(row(k))) : row(k) / largest;
    if (!(largest > 0)) row.setZero();
  }
  return share;
}

std::vector<int> modes_by_observability(const ReducedBody& body, const std::vector<ObservedOutput>& outputs,
                                        double threshold) {
  const MatrixXd share = observabilities(body, outputs);
  for (Index i = 0; i < share.rows(); ++i)
    require(share.cols() == 0 || share.row(i).maxCoeff() > 0,
            fmt::format("modes: none of all {} moves {} along {}; make more modes", body.n(),
                        outputs[static_cast<size_t>(i)].marker, outputs[static_cast<size_t>(i)].direction));
  std::vector<int> chosen;
  for (int k = 0; k < body.n(); ++k) {
    if (share.rows() > 0 && share.col(k).maxCoeff() >= threshold) chosen.push_back(k);
  }
  return chosen;
}

}  // namespace flexboom
