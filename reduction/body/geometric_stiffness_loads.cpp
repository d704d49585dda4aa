#include "reduction/body/geometric_stiffness_loads.hpp"

#include "fem/base/check.hpp"
#include "reduction/body/tilde.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <functional>
#include <numeric>
#include <span>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// The fields b at the nodes, freedoms x 12: rotations are half their curl, internal freedoms zero.
MatrixXd nodal_fields(const Mesh& mesh, const DofMap& dofs, const LinearFields& fields) {
  MatrixXd B = MatrixXd::Zero(dofs.count, inertial_loads);
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    const int freedoms = dofs.freedoms_of(node);
    if (freedoms == 0) continue;
    for (Index c = 0; c < inertial_loads; ++c) {
      const Matrix3d A = fields.col(c).tail<9>().reshaped(3, 3);
      B.col(c).segment<3>(dofs.of_node(node, 0)) = fields.col(c).head<3>() + A * mesh.nodes.col(node);
      if (freedoms < 6) continue;
      B.col(c).segment<3>(dofs.of_node(node, 3)) =
          Vector3d(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)) / 2;
    }
  }
  return B;
}

/// Visits the mass points of beams and of bodies on nodes with their arm from the axis or node, and theta = rotation *
/// (values of the freedoms).
using ArmVisitor = std::function<void(double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N,
                                      const Vector3d& arm, const Matrix3Xd& rotation, std::span<const int> dofs)>;

void for_each_beam_point(const Mesh& mesh, const DofMap& dofs, const ArmVisitor& visit) {
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    if (type_of(element).shape != Shape::line) continue;
    const std::vector<int> of_element = dofs.of_element(mesh, e);
    const Vector3d start = mesh.nodes.col(element.nodes[0]), axis = mesh.nodes.col(element.nodes[1]) - start;
    type_of(element).mass_points(
        mesh, element, 0, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
          const double s = axis.dot(u0 - start) / axis.squaredNorm();
          const Matrix3Xd rotation = type_of(element).interpolation(mesh, element, {s, 0, 0}).bottomRows<3>();
          visit(dm, u0, N, u0 - start - s * axis, rotation, of_element);
        });
  }
}

void for_each_body_point(const Mesh& mesh, const DofMap& dofs, const ArmVisitor& visit) {
  for (const NodalBody& body : mesh.bodies) {
    const int freedoms = dofs.freedoms_of(body.node);
    std::vector<int> of_node(static_cast<size_t>(freedoms));
    std::iota(of_node.begin(), of_node.end(), dofs.of_node(body.node, 0));
    Matrix3Xd rotation = Matrix3Xd::Zero(3, freedoms);
    if (freedoms == 6) rotation.rightCols<3>().setIdentity();
    nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
      visit(dm, u0, N.leftCols(freedoms), u0 - mesh.nodes.col(body.node), rotation, of_node);
    });
  }
}

void for_each_arm(const Mesh& mesh, const DofMap& dofs, const ArmVisitor& visit) {
  for_each_beam_point(mesh, dofs, visit);
  for_each_body_point(mesh, dofs, visit);
}

/// Values of linear fields at a point, 3 x loads.
MatrixXd values_at(const LinearFields& fields, const Vector3d& u0) {
  MatrixXd b = fields.topRows<3>();
  for (Index j = 0; j < 3; ++j) b += u0(j) * fields.middleRows<3>(3 + 3 * j);
  return b;
}

/// Adds theta^T W theta, W = (f . r) I - (f r^T + r f^T) / 2, for the forces f (3 x loads) on an arm r: less their work
/// on its second-order displacement theta x (theta x r) / 2.
void add_arm(std::vector<MatrixXd>& Kg, const MatrixXd& forces, const Vector3d& r, const MatrixXd& theta) {
  for (size_t c = 0; c < Kg.size(); ++c) {
    const Vector3d f = forces.col(static_cast<Index>(c));
    const Matrix3d W = f.dot(r) * Matrix3d::Identity() - (f * r.transpose() + r * f.transpose()) / 2;
    Kg[c] += theta.transpose() * W * theta;
  }
}

}  // namespace

LinearFields inertial_fields() {
  LinearFields fields = LinearFields::Zero(12, inertial_loads);
  for (Index c = 0; c < 6; ++c) {  // -w x (w x u0)
    const auto [i, j] = spin_products[static_cast<size_t>(c)];
    Matrix3d A = -tilde(Vector3d::Unit(i)) * tilde(Vector3d::Unit(j));
    if (i != j) A += A.transpose().eval();
    fields.col(c).tail<9>() = A.reshaped();
  }
  for (int i = 0; i < 3; ++i) {
    fields(i, 6 + i) = -1;                                               // -a
    fields.col(9 + i).tail<9>() = -tilde(Vector3d::Unit(i)).reshaped();  // -alpha x u0
  }
  return fields;
}

MatrixXd inertial_forces(const Mesh& mesh, const Assembly& assembly) {
  const LinearFields fields = inertial_fields();
  const MatrixXd B = nodal_fields(mesh, assembly.dofs, fields);
  MatrixXd F = symmetric_product(assembly.M, B);
  for_each_arm(mesh, assembly.dofs,
               [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N, const Vector3d&,
                   const Matrix3Xd&, std::span<const int> dofs) {
                 F(dofs, Eigen::all) += dm * N.transpose() * (values_at(fields, u0) - N * B(dofs, Eigen::all));
               });
  return F;
}

MatrixXd marker_forces(const Mesh& mesh, const DofMap& dofs, const std::string& name) {
  const std::vector<int>& nodes = node_set(mesh, name);
  require(!nodes.empty(), fmt::format("marker \"{}\": its node set is empty", name));
  if (nodes.size() == 1) {
    const Index count = dofs.freedoms_of(nodes.front());
    MatrixXd forces = MatrixXd::Zero(dofs.count, count);
    forces.middleRows(dofs.of_node(nodes.front(), 0), count).setIdentity();
    return forces;
  }
  const Vector3d centre = mesh.nodes(Eigen::all, nodes).rowwise().mean();
  Matrix3d J = Matrix3d::Zero();
  for (const int node : nodes) {
    const Vector3d r = mesh.nodes.col(node) - centre;
    J += r.squaredNorm() * Matrix3d::Identity() - r * r.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(J);
  require(principal.eigenvalues()(0) > 1e-12 * principal.eigenvalues()(2),
          fmt::format("marker \"{}\": its nodes lie on a line and carry no torque about it", name));
  const Matrix3d inverse = J.inverse();
  MatrixXd forces = MatrixXd::Zero(dofs.count, 6);
  for (const int node : nodes) {
    const Vector3d r = mesh.nodes.col(node) - centre;
    auto rows = forces.middleRows<3>(dofs.of_node(node, 0));
    rows.leftCols<3>() = Matrix3d::Identity() / static_cast<double>(nodes.size());
    for (Index k = 0; k < 3; ++k) rows.col(3 + k) = inverse.col(k).cross(r);
  }
  return forces;
}

void add_inertia_of_arms(std::vector<MatrixXd>& Kg, const Mesh& mesh, const DofMap& dofs, const LinearFields& fields,
                         const MatrixXd& Phi) {
  for_each_arm(mesh, dofs,
               [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>&, const Vector3d& arm,
                   const Matrix3Xd& rotation, std::span<const int> point_dofs) {
                 if (arm.isZero(0)) return;
                 add_arm(Kg, dm * values_at(fields, u0), arm, rotation * Phi(point_dofs, Eigen::all));
               });
}

void add_rigid_connections(std::vector<MatrixXd>& Kg, const Mesh& mesh, const Assembly& assembly, const MatrixXd& F,
                           const MatrixXd& U0, const MatrixXd& Phi) {
  if (mesh.rigid_connections.empty()) return;
  const DofMap& dofs = assembly.dofs;
  const MatrixXd forces = F - symmetric_product(assembly.K, U0);  // of the nodes on what they are tied to
  for (const RigidConnection& c : mesh.rigid_connections) {
    const MatrixXd theta = Phi.middleRows<3>(dofs.of_node(c.reference, 3));
    for (const int node : c.nodes) {
      if (node == c.reference) continue;
      MatrixXd carried = forces.middleRows<3>(dofs.of_node(node, 0));
      for (Index k = 0; k < 3; ++k) {
        if (!c.components[static_cast<size_t>(k)]) carried.row(k).setZero();
      }
      add_arm(Kg, carried, mesh.nodes.col(node) - mesh.nodes.col(c.reference), theta);
    }
  }
}

}  // namespace flexboom
