#include "dynamics/hub_momenta.hpp"
#include "dynamics/inner_loop.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/system_impl.hpp"

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::eigen;

namespace {

FLEXBOOM_INNER_LOOP
equations::Together together(const equations::Model& model, const double* p, const double* u, Workspace& w) {
  return equations::together(model, p, u, w.scratch);
}

Vector3d about_mass_centre(const equations::Together& all) {
  return eigen(all.angular_momentum) - eigen(all.first_moment).cross(eigen(all.momentum)) / all.m;
}

/// What |r|^2 I - r r^T is for all mass at r.
Matrix3d at(const Vector3d& r, double m) { return m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose()); }

}  // namespace

Balance System::balance(const Eigen::Ref<const VectorXd>& y, Workspace& w) const {
  const Layout& l = layout();
  const equations::Together all = together(impl_->model, y.data(), y.data() + l.u_begin(), w);
  Matrix3d A = Matrix3d::Identity();
  Vector3d V = Vector3d::Zero();
  if (!fixed_hub()) {
    A = rotation_matrix(y.segment<4>(l.attitude()));
    V = y.segment<3>(l.velocity());
  }
  const Vector3d P = A * eigen(all.momentum);
  Balance r;
  r.kinetic = all.kinetic + V.dot(P) + 0.5 * all.m * V.squaredNorm();
  r.elastic = all.strain;
  for (size_t i = 0; i < l.body.size(); ++i) r.elastic += energy(appendages()[i].hinge.mechanism, y[l.body[i]]);
  r.momentum = all.m * V + P;
  r.momentum_scale = all.momentum_scale + all.m * V.norm();
  r.angular_momentum = A * about_mass_centre(all);
  r.angular_momentum_scale = all.angular_momentum_scale;
  return r;
}

Whole System::whole(const Eigen::Ref<const VectorXd>& y, Workspace& w) const {
  const equations::Together all = together(impl_->model, y.data(), y.data() + layout().u_begin(), w);
  const Vector3d c = eigen(all.first_moment) / all.m;
  return {c, eigen(all.momentum) / all.m, eigen(all.inertia) - at(c, all.m), about_mass_centre(all)};
}

}  // namespace flexboom
