#pragma once

// Inertial, elastic and gravity forces of one flexible body with its accelerations given. Internal to the redundant
// coordinates.

#include "dynamics/model/multibody.hpp"
#include "dynamics/redundant/place.hpp"
#include "reduction/body/reduced_body.hpp"

#include <vector>

namespace flexboom::redundant {

using spatial::Sym3;

struct BodyData {
  size_t n = 0,
         shapes = 0;  // coordinates; shapes, of which those beyond n follow the coordinates (geometric stiffness)
  double m = 0;
  Vec3<double> mc0;
  Sym3<double> J0;
  std::vector<Vec3<double>> Ct, Cr0;  // of all shapes, as the integrals below
  std::vector<Entry> J1, J2, Cr1;     // components xx, yy, zz, xy, yz, zx; Cr1: x, y, z
  Eigen::MatrixXd Me, Ke, De;         // n x n
  std::vector<Entry> follow;          // shape n + component moves by 1/2 sum value q_k q_l
  Eigen::MatrixXd Me_follow;          // (shapes - n) x n
};

/// @throws InputError when geometric stiffness is asked for but the body has none.
BodyData body_data(const ReducedBody&, Stiffening);

/// A deformed body (README, "Geometric stiffness in the equations"). Vectors over all shapes but for `slope`.
struct DeformedBody {
  Vec3<double> mc{};
  std::array<double, 6> J{};
  std::vector<Vec3<double>> Cr;
  std::vector<double> q, q_dot, q_ddot, on_q;
  std::vector<double> slope;  // d q_a / d q_k of what follows, (shapes - n) x n by rows

  explicit DeformedBody(const BodyData& b)
      : Cr(b.shapes), q(b.shapes), q_dot(b.shapes), q_ddot(b.shapes), on_q(b.shapes), slope((b.shapes - b.n) * b.n) {}
};

/// Sets mc, J, Cr, q and slope.
void deform(const BodyData&, const double* q, DeformedBody&);

/// Motion of a body. acceleration: of R less gravity, inertial axes.
struct BodyInput {
  Mat3<double> A;
  Vec3<double> w;
  const double *q = nullptr, *q_dot = nullptr;
  Vec3<double> acceleration, w_dot;
  const double* q_ddot = nullptr;
};

/// Left-hand side of the equations of one body (README, "Equations of motion"): what external forces must equal.
/// on_R: inertial axes. The last is scratch.
void body_forces(const BodyData&, const BodyInput&, Vec3<double>& on_R, Vec3<double>& on_w, double* on_q,
                 DeformedBody&);

/// Derivatives of body_forces with the accelerations as they are. Rows: on_R, on_w, on_q; columns: small rotations in
/// the body's axes, w, q, q_dot: (6 + n) x (6 + 2 n). The last is scratch.
Eigen::MatrixXd body_force_derivatives(const BodyData&, const BodyInput&, DeformedBody&);

/// Mass matrix over the freedoms [R, small rotations, q] of a body at q with axes A, (6 + n) x (6 + n). The last is
/// scratch.
Eigen::MatrixXd body_mass(const BodyData&, const Mat3<double>& A, const double* q, DeformedBody&);

/// Momenta about the BRF origin and kinetic energy, BRF axes; v: velocity of R in them. The last is scratch.
void body_momenta(const BodyData&, const Vec3<double>& v, const Vec3<double>& w, const double* q, const double* q_dot,
                  Vec3<double>& P, Vec3<double>& H, double& kinetic, DeformedBody&);

}  // namespace flexboom::redundant
