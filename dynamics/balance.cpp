#include "dynamics/hub_momenta.hpp"
#include "dynamics/inner_loop.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/system_impl.hpp"

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::eigen;

namespace {

double hinge_energy(const HingeMechanism& m, double gap) {
  const double stretch = gap + m.threshold - m.rest, depth = std::max(0.0, gap);
  return 0.5 * m.stiffness * stretch * stretch + 0.5 * m.stop_stiffness * depth * depth;
}

FLEXBOOM_INNER_LOOP
equations::Together together(const equations::Model& model, const double* p, const double* u, Workspace& w) {
  return equations::together(model, p, u, w.scratch);
}

/// What |r|^2 I - r r^T is for all mass at r.
Matrix3d at(const Vector3d& r, double m) { return m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose()); }

}  // namespace

Balance System::balance(const Eigen::Ref<const VectorXd>& y, Workspace& w) const {
  const Layout& l = layout();
  const equations::Together all = together(impl_->model, y.data(), y.data() + l.u_begin(), w);
  Balance r;
  r.kinetic = all.kinetic;
  r.elastic = all.strain;
  for (size_t i = 0; i < l.body.size(); ++i) r.elastic += hinge_energy(appendages()[i].hinge.mechanism, y[l.body[i]]);
  r.momentum_scale = all.momentum_scale;
  r.angular_momentum_scale = all.angular_momentum_scale;
  const Vector3d P = eigen(all.momentum), H = eigen(all.angular_momentum), moment = eigen(all.first_moment);
  const Vector3d about_mass_centre = H - moment.cross(P) / all.m;
  if (fixed_hub()) {
    r.momentum = P;
    r.angular_momentum = about_mass_centre;
    return r;
  }
  const Matrix3d A = rotation_matrix(y.segment<4>(l.attitude()));
  const Vector3d V = y.segment<3>(l.velocity());
  r.momentum = all.m * V + A * P;
  r.momentum_scale += all.m * V.norm();
  r.kinetic += V.dot(A * P) + 0.5 * all.m * V.squaredNorm();
  r.angular_momentum = A * about_mass_centre;
  return r;
}

Whole System::whole(const Eigen::Ref<const VectorXd>& y, Workspace& w) const {
  const equations::Together all = together(impl_->model, y.data(), y.data() + layout().u_begin(), w);
  const Vector3d c = eigen(all.first_moment) / all.m, P = eigen(all.momentum);
  return {c, P / all.m, eigen(all.inertia) - at(c, all.m), eigen(all.angular_momentum) - c.cross(P)};
}

}  // namespace flexboom
