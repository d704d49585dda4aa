#include "fem/mesh/elasticity.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <string>

namespace flexboom::elasticity {

using Eigen::Index;
using Eigen::MatrixXd;

Lame lame(const Material& m) { return {m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)), m.shear_modulus()}; }

const Material& material_of(const Mesh& mesh, const Element& element) {
  return mesh.solid_properties[static_cast<size_t>(element.property)].material;
}

Eigen::MatrixX3d local_positions(const Mesh& mesh, const Element& element) {
  Eigen::MatrixX3d positions(std::ssize(element.nodes), 3);
  const Eigen::Vector3d first = mesh.nodes.col(element.nodes[0]);
  for (Index a = 0; a < positions.rows(); ++a) {
    positions.row(a) = mesh.nodes.col(element.nodes[static_cast<size_t>(a)]) - first;
  }
  return positions;
}

MatrixXd strain_rows(const Eigen::Ref<const Eigen::MatrixX3d>& gradients) {
  MatrixXd B = MatrixXd::Zero(6, 3 * gradients.rows());
  for (Index a = 0; a < gradients.rows(); ++a) {
    const double x = gradients(a, 0), y = gradients(a, 1), z = gradients(a, 2);
    B.block<6, 3>(0, 3 * a) << x, 0, 0, 0, y, 0, 0, 0, z, y, x, 0, 0, z, y, z, 0, x;
  }
  return B;
}

MatrixXd elasticity_matrix(const Lame& m) {
  MatrixXd D = MatrixXd::Zero(6, 6);
  D.topLeftCorner<3, 3>().setConstant(m.lambda);
  D.diagonal() << Eigen::Vector3d::Constant(m.lambda + 2 * m.mu), Eigen::Vector3d::Constant(m.mu);
  return D;
}

Matrix6X motion_rows(const Eigen::Ref<const Eigen::VectorXd>& values,
                     const Eigen::Ref<const Eigen::MatrixX3d>& gradients) {
  Matrix6X rows = Matrix6X::Zero(6, 3 * values.size());
  for (Index a = 0; a < values.size(); ++a) {
    const double x = gradients(a, 0) / 2, y = gradients(a, 1) / 2, z = gradients(a, 2) / 2;
    rows.block<3, 3>(0, 3 * a).diagonal().setConstant(values(a));
    rows.block<3, 3>(3, 3 * a) << 0, -z, y, z, 0, -x, -y, x, 0;
  }
  return rows;
}

MatrixXd stiffness_from_gradients(const MatrixXd& H, const Lame& m) {
  const Index n = H.rows() / 3;
  MatrixXd K = MatrixXd::Zero(3 * n, 3 * n);
  const double p = m.lambda + 2 * m.mu;
  for (Index b = 0; b < n; ++b) {
    for (Index a = b; a < n; ++a) {
      const double xx = H(a, b), yy = H(n + a, n + b), zz = H(2 * n + a, 2 * n + b);
      // yx is the sum of w g_ay g_bx, xy of w g_ax g_by.
      const double yx = H(n + a, b), zx = H(2 * n + a, b), zy = H(2 * n + a, n + b);
      const double xy = H(n + b, a), xz = H(2 * n + b, a), yz = H(2 * n + b, n + a);
      double* column = &K(3 * a, 3 * b);
      column[0] = p * xx + m.mu * (yy + zz);
      column[1] = m.lambda * yx + m.mu * xy;
      column[2] = m.lambda * zx + m.mu * xz;
      column += 3 * n;
      column[0] = m.lambda * xy + m.mu * yx;
      column[1] = p * yy + m.mu * (zz + xx);
      column[2] = m.lambda * zy + m.mu * yz;
      column += 3 * n;
      column[0] = m.lambda * xz + m.mu * zx;
      column[1] = m.lambda * yz + m.mu * zy;
      column[2] = p * zz + m.mu * (xx + yy);
    }
  }
  return K;
}

MatrixXd mass_from_scalar(const MatrixXd& m) {
  const Index n = m.rows();
  MatrixXd M = MatrixXd::Zero(3 * n, 3 * n);
  for (Index b = 0; b < n; ++b) {
    for (Index a = b; a < n; ++a) {
      for (Index i = 0; i < 3; ++i) M(3 * a + i, 3 * b + i) = m(a, b);
    }
  }
  return M;
}

void MassPoint::visit(double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::VectorXd>& values,
                      const MassPointVisitor& visitor) {
  for (Index a = 0; a < values.size(); ++a) N_.middleCols<3>(3 * a).diagonal().setConstant(values(a));
  visitor(dm, u0, N_);
}

void require_property(const Mesh& mesh, const Element& element) {
  require(element.property >= 0 && element.property < static_cast<int>(mesh.solid_properties.size()),
          fmt::format("solid property {} is missing; the mesh has {}", element.property, mesh.solid_properties.size()));
}

void throw_inverted(double determinant, int point) {
  throw InputError(
      fmt::format("inverted (Jacobian {:.2g} at integration point {}); reorder its nodes or repair the mesh",
                  determinant, point + 1));
}

}  // namespace flexboom::elasticity
