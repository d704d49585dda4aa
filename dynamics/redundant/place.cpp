#include "dynamics/redundant/place.hpp"

namespace flexboom::redundant {

using Eigen::Index;

PlaceShapes shapes_at(const PlaceData& p, const double* q) {
  PlaceShapes shapes{p.S, p.S_theta};
  const auto add = [q](const std::vector<Entry>& slope, Eigen::Matrix3Xd& S) {
    for (const Entry& e : slope) S(static_cast<Index>(e.component), static_cast<Index>(e.k)) += e.value * q[e.l];
  };
  add(p.S_slope, shapes.S);
  add(p.theta_slope, shapes.S_theta);
  return shapes;
}

Elastic<double> elastic_at(const PlaceData& p, const double* q, const double* q_dot) {
  Elastic<double> e;
  for (Index k = 0; k < p.S.cols(); ++k) {
    const double* const S = p.S.col(k).data();
    const double* const T = p.S_theta.col(k).data();
    const Vec3<double> shift{S[0], S[1], S[2]}, turn{T[0], T[1], T[2]};
    e.s += q[k] * shift, e.phi += q[k] * turn, e.s_dot += q_dot[k] * shift, e.phi_dot += q_dot[k] * turn;
  }
  const auto add = [&](const std::vector<Entry>& slope, Vec3<double>& x, Vec3<double>& x_dot) {
    for (const Entry& s : slope) {
      component(x, s.component) += 0.5 * s.value * (q[s.k] * q[s.l]);
      component(x_dot, s.component) += s.value * (q[s.l] * q_dot[s.k]);
    }
  };
  add(p.S_slope, e.s, e.s_dot);
  add(p.theta_slope, e.phi, e.phi_dot);
  return e;
}

Elastic<double> elastic_bias(const PlaceData& p, const double* q_dot) {
  Elastic<double> e;
  for (const Entry& s : p.S_slope) component(e.s_dot, s.component) += s.value * (q_dot[s.k] * q_dot[s.l]);
  for (const Entry& s : p.theta_slope) component(e.phi_dot, s.component) += s.value * (q_dot[s.k] * q_dot[s.l]);
  return e;
}

}  // namespace flexboom::redundant
