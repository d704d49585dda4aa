#include "reduction/exports/integrals.hpp"

#include "fem/base/check.hpp"
#include "reduction/body/diagonal.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <cctype>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::MatrixXd;

void transform(std::vector<MatrixXd>& matrices, const MatrixXd& T) {
  for (MatrixXd& K : matrices) K = (T.transpose() * K * T).eval();
}

}  // namespace

RawIntegrals::RawIntegrals(const ReducedBody& body, std::string_view format) : gram_(body.gram) {
  require(body.n() == 0 || gram_.rows() == 4 + 3 * body.n(),
          fmt::format("body \"{}\" has no raw integrals (gram), which the format {} needs; make it by reduce or from "
                      "eq. 14",
                      body.name, format));
}

ReducedBody in_coordinates(const ReducedBody& body, const MatrixXd& T) {
  const Eigen::Index n = body.n();
  require(T.rows() == n && T.cols() == n, fmt::format("in_coordinates: T must be {} x {}", n, n));
  const RawIntegrals raw(body, "change of coordinates");
  // z = (1, u0, S_1, ..., S_n) turns into z' = Z^T z.
  MatrixXd Z = MatrixXd::Identity(4 + 3 * n, 4 + 3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) Z.block<3, 3>(4 + 3 * k, 4 + 3 * l) = T(k, l) * Eigen::Matrix3d::Identity();
  }
  const auto symmetric = [&T](const MatrixXd& A) -> MatrixXd {
    const MatrixXd B = T.transpose() * A * T;
    return (B + B.transpose()) / 2;
  };
  ReducedBody result = body;
  const MatrixXd gram = Z.transpose() * body.gram * Z;
  set_invariants(result, (gram + gram.transpose()) / 2);
  result.Ke = symmetric(body.Ke);
  result.De = T.transpose() * body.De * T;
  for (Marker& m : result.markers) {
    m.S *= T;
    m.S_theta *= T;
  }
  for (Eigen::Matrix3Xd& S : result.display.S) S *= T;
  for (Eigen::Matrix3Xd& S : result.display.S_theta) S *= T;
  transform(result.Kg.spin, T);
  transform(result.Kg.acceleration, T);
  transform(result.Kg.angular_acceleration, T);
  for (MarkerStiffness& m : result.Kg.markers) {
    transform(m.force, T);
    transform(m.torque, T);
  }
  return result;
}

ModalCoordinates modal_coordinates(const ReducedBody& body) {
  if (body.n() == 0) return {MatrixXd(0, 0), {}, {}};
  if (is_diagonal(body.Me) && is_diagonal(body.Ke)) {
    const Eigen::VectorXd mass = body.Me.diagonal();
    return {mass.cwiseSqrt().cwiseInverse().asDiagonal(), body.Ke.diagonal().cwiseQuotient(mass), body.coordinates};
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(body.Ke, body.Me);
  ModalCoordinates modal{solver.eigenvectors(), solver.eigenvalues(), {}};
  for (auto mode : modal.T.colwise()) {  // of the sign of the coordinate that it has most of
    Eigen::Index most = 0;
    mode.cwiseAbs().maxCoeff(&most);
    if (mode[most] < 0) mode *= -1;
  }
  for (const double lambda : modal.lambda) {
    modal.coordinates.push_back({"mode", std::sqrt(std::max(lambda, 0.0)) / (2 * std::numbers::pi)});
  }
  return modal;
}

ReducedBody with_unit_modal_mass(const ReducedBody& body) {
  if (body.n() == 0) return body;
  ModalCoordinates modal = modal_coordinates(body);
  ReducedBody result = in_coordinates(body, modal.T);
  result.Me.setIdentity();  // round-off goes
  result.Ke = modal.lambda.asDiagonal();
  if (!modal.T.isDiagonal(0)) result.interfaces.clear();  // their components are no coordinates any more
  result.coordinates = std::move(modal.coordinates);
  return result;
}

std::string plain_name(std::string_view name) {
  std::string plain(name);
  for (char& c : plain) {
    const bool keep = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.' || c == '+';
    if (!keep) c = '_';
  }
  return plain.empty() ? "_" : plain;
}

}  // namespace flexboom
