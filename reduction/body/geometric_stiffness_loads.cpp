#include "reduction/body/geometric_stiffness_loads.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/shape_pairs.hpp"
#include "reduction/body/tilde.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

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

/// What turns as one, a section of a beam or a body on a node: theta = rotation * (values of the freedoms).
struct TurningPart {
  Matrix3Xd rotation;
  std::vector<int> dofs;
  int number = 0;  // differs from one to the next
};

/// Visits the mass points of beams and of bodies on nodes with their arm from the axis or node.
using ArmVisitor = std::function<void(double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N,
                                      const Vector3d& arm, const TurningPart&)>;

void for_each_beam_point(const Mesh& mesh, const DofMap& dofs, const ArmVisitor& visit) {
  constexpr double same = 1e-12;  // of an element's length: points of one section
  TurningPart section;
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    const ElementType& type = type_of(element);
    if (type.shape != Shape::line) continue;
    section.dofs = dofs.of_element(mesh, e);
    const Vector3d start = mesh.nodes.col(element.nodes[0]), axis = mesh.nodes.col(element.nodes[1]) - start;
    double s = -1;
    type.mass_points(mesh, element, 0, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
      const double here = axis.dot(u0 - start) / axis.squaredNorm();
      if (std::abs(here - s) > same) {
        s = here;
        section.rotation = type.interpolation(mesh, element, {s, 0, 0}).bottomRows<3>();
        ++section.number;
      }
      visit(dm, u0, N, u0 - start - s * axis, section);
    });
  }
}

void for_each_body_point(const Mesh& mesh, const DofMap& dofs, const ArmVisitor& visit) {
  TurningPart part;
  for (const NodalBody& body : mesh.bodies) {
    const int freedoms = dofs.freedoms_of(body.node);
    part.dofs.resize(static_cast<size_t>(freedoms));
    std::iota(part.dofs.begin(), part.dofs.end(), dofs.of_node(body.node, 0));
    part.rotation = Matrix3Xd::Zero(3, freedoms);
    if (freedoms == 6) part.rotation.rightCols<3>().setIdentity();
    --part.number;
    nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
      visit(dm, u0, N.leftCols(freedoms), u0 - mesh.nodes.col(body.node), part);
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

/// Loads on what turns as one. Each load has a column: the entries xx, yy, zz, xy, yz, zx of a symmetric matrix W. Half
/// of theta^T W theta is minus the work of the load on the second-order displacement theta x (theta x r) / 2.
class LoadsOnArms {
 public:
  explicit LoadsOnArms(Index loads) : W_(6, loads) { W_.setZero(); }

  /// W += (f . r) I - (f r^T + r f^T) / 2, for the forces f (3 x loads) on an arm r.
  void add(const MatrixXd& f, const Vector3d& r) {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      W_.row(i) += r(j) * f.row(j) + r(k) * f.row(k);
      W_.row(3 + i) -= (r(i) * f.row(j) + r(j) * f.row(i)) / 2;
    }
  }

  /// Adds the work on what turns by theta (3 x shapes), and forgets the loads.
  void work_on(const MatrixXd& theta, MatrixXd& work) {
    if (W_.isZero(0)) return;
    pairs_.setZero(number_of_pairs(theta.cols()), 6);
    for (int i = 0; i < 3; ++i) {
      add_pairs(pairs_.col(i), 0.5, theta.row(i), theta.row(i));
      add_pairs(pairs_.col(3 + i), 1, theta.row(i), theta.row((i + 1) % 3));
    }
    work.noalias() += pairs_ * W_;
    W_.setZero();
  }

 private:
  Eigen::Matrix<double, 6, Eigen::Dynamic> W_;
  MatrixXd pairs_;
};

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
                   const TurningPart& part) {
                 F(part.dofs, Eigen::all) +=
                     dm * N.transpose() * (values_at(fields, u0) - N * B(part.dofs, Eigen::all));
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

void add_inertia_of_arms(MatrixXd& work, const Mesh& mesh, const DofMap& dofs, const LinearFields& fields,
                         const MatrixXd& Phi) {
  LoadsOnArms loads(fields.cols());
  TurningPart last;
  const auto work_on_last = [&] {
    if (last.number != 0) loads.work_on(last.rotation * Phi(last.dofs, Eigen::all), work);
  };
  for_each_arm(mesh, dofs,
               [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>&, const Vector3d& arm,
                   const TurningPart& part) {
                 if (part.number != last.number) work_on_last(), last = part;
                 loads.add(dm * values_at(fields, u0), arm);
               });
  work_on_last();
}

void add_rigid_connections(MatrixXd& work, const Mesh& mesh, const Assembly& assembly, const MatrixXd& F,
                           const MatrixXd& U0, const MatrixXd& Phi) {
  if (mesh.rigid_connections.empty()) return;
  const DofMap& dofs = assembly.dofs;
  const MatrixXd forces = F - symmetric_product(assembly.K, U0);  // of the nodes on what they are tied to
  LoadsOnArms loads(F.cols());
  for (const RigidConnection& c : mesh.rigid_connections) {
    for (const int node : c.nodes) {
      if (node == c.reference) continue;
      MatrixXd carried = forces.middleRows<3>(dofs.of_node(node, 0));
      for (Index k = 0; k < 3; ++k) {
        if (!c.components[static_cast<size_t>(k)]) carried.row(k).setZero();
      }
      loads.add(carried, mesh.nodes.col(node) - mesh.nodes.col(c.reference));
    }
    loads.work_on(Phi.middleRows<3>(dofs.of_node(c.reference, 3)), work);
  }
}

}  // namespace flexboom
