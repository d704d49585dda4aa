#include "fem/elasticity.hpp"

#include "fem/check.hpp"
#include "fem/dense.hpp"
#include "fem/lanes.hpp"

#include <fmt/format.h>

#include <algorithm>
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

namespace {

// Second-order strains xx yy zz xy yz zx (engineering shear) of all pairs of vectors: entry `pair` of component c at
// strains[c * pairs + pair]. Slopes: count x 9, column 3 i + m holds the slope of component m along x_i.
FLEXBOOM_FOR_EACH_PROCESSOR void set_second_order(const double* slopes, int count, int pairs, double* strains) {
  for (int k = 0, first = 0; k < count; first += count - k, ++k) {
    double of_k[9];
    for (int i = 0; i < 9; ++i) of_k[i] = slopes[i * count + k];
    const double* const of_l = slopes + k;
    double* const to = strains + first;
    const auto slope = [of_l, count](int i, int l) { return of_l[i * count + l]; };
    const auto work = [&](int i, int j, int l) {
      return of_k[3 * i] * slope(3 * j, l) + of_k[3 * i + 1] * slope(3 * j + 1, l) +
             of_k[3 * i + 2] * slope(3 * j + 2, l);
    };
#pragma GCC ivdep
    for (int l = 0; l < count - k; ++l) {
      to[l] = work(0, 0, l);
      to[pairs + l] = work(1, 1, l);
      to[2 * pairs + l] = work(2, 2, l);
      to[3 * pairs + l] = work(0, 1, l) + work(1, 0, l);
      to[4 * pairs + l] = work(1, 2, l) + work(2, 1, l);
      to[5 * pairs + l] = work(2, 0, l) + work(0, 2, l);
    }
  }
}

Eigen::Matrix<double, 6, 1> stress(const Eigen::Matrix3d& gradient, const Lame& m) {
  const Eigen::Matrix3d strain = gradient + gradient.transpose();
  Eigen::Matrix<double, 6, 1> s;
  s.head<3>() = m.mu * strain.diagonal().array() + m.lambda * gradient.trace();
  s.tail<3>() = m.mu * Eigen::Vector3d(strain(0, 1), strain(1, 2), strain(2, 0));
  return s;
}

}  // namespace

MatrixXd prestress_work(const Eigen::VectorXd& volumes, const MatrixXd& gradients, Index modes, const Lame& lame) {
  const Index loads = gradients.cols() / 3 - modes, pairs = modes * (modes + 1) / 2, points = volumes.size();
  const Index block = std::max<Index>(1, 98304 / (6 * pairs + 1));  // points whose pairs are held at a time: 0.8 MB
  MatrixXd work = MatrixXd::Zero(pairs, loads);
  MatrixXd strains(pairs, 6 * std::min(block, points)), stresses(6 * std::min(block, points), loads);
  Eigen::Matrix<double, Eigen::Dynamic, 9> slopes(modes, 9);
  for (Index first = 0; first < points; first += block) {
    const Index count = std::min(block, points - first);
    for (Index p = 0; p < count; ++p) {
      const auto rows = gradients.middleRows<3>(3 * (first + p));
      for (Index k = 0; k < modes; ++k) {
        for (Index i = 0; i < 3; ++i) slopes.block<1, 3>(k, 3 * i) = rows.block<1, 3>(i, 3 * k);
      }
      set_second_order(slopes.data(), static_cast<int>(modes), static_cast<int>(pairs), strains.col(6 * p).data());
      for (Index c = 0; c < loads; ++c) {
        stresses.block<6, 1>(6 * p, c) = volumes(first + p) * stress(rows.block<3, 3>(0, 3 * (modes + c)), lame);
      }
    }
    add_product(work, 1, Transposed::no, strains.leftCols(6 * count), stresses.topRows(6 * count));
  }
  return work;
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

void throw_inverted(double determinant, const std::string& place) {
  throw InputError(
      fmt::format("inverted (Jacobian {:.2g} at {}); reorder its nodes or repair the mesh", determinant, place));
}

}  // namespace flexboom::elasticity
