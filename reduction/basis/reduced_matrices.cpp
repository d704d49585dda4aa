#include "reduction/basis/reduced_matrices.hpp"

#include "fem/base/parallel.hpp"
#include "fem/linear_algebra/dense.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Sum of z z^T over many columns z, some hundred at a time: a product of dense blocks instead of updates of rank 1.
class GramSum {
 public:
  explicit GramSum(Index size, Index at_a_time = 256) : sum_(MatrixXd::Zero(size, size)), block_(size, at_a_time) {}

  /// The next column z [times sqrt(dm)], to be written.
  MatrixXd::ColXpr next() {
    if (filled_ == block_.cols()) flush();
    return block_.col(filled_++);
  }

  void add(const MatrixXd& Z) {
    if (filled_ + Z.cols() > block_.cols()) flush();
    if (Z.cols() > block_.cols()) return add_gram(sum_, Z);
    block_.middleCols(filled_, Z.cols()) = Z;
    filled_ += Z.cols();
  }

  const MatrixXd& sum() {
    flush();
    return sum_;
  }

 private:
  void flush() {
    add_gram(sum_, block_.leftCols(filled_));
    filled_ = 0;
  }

  MatrixXd sum_;
  MatrixXd block_;
  Index filled_ = 0;
};

/// Columns z sqrt(dm) of the mass points that `visit_points` passes, with the shapes of their freedoms.
template <class VisitPoints>
void add_points(GramSum& gram, const MatrixXd& shapes, const VisitPoints& visit_points) {
  visit_points([&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
    const double root = std::sqrt(dm);
    auto z = gram.next();
    z(0) = root;
    z.template segment<3>(1) = root * u0;
    z.tail(z.size() - 4).reshaped(3, shapes.cols()).noalias() = root * N.leftCols(shapes.rows()) * shapes;
  });
}

MatrixXd gram_of_bodies(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi) {
  GramSum gram(4 + 3 * Phi.cols());
  for (const NodalBody& body : mesh.bodies) {
    const MatrixXd shapes = Phi.middleRows(dofs.of_node(body.node, 0), dofs.freedoms_of(body.node));
    add_points(gram, shapes, [&](const auto& visit) { nodal_body_mass_points(mesh, body, visit); });
  }
  return gram.sum().selfadjointView<Eigen::Lower>();
}

/// Sum over blocks of elements of what `add(element, sum)` adds; the blocks are the same for any number of threads.
template <class MakeSum, class Add>
auto sum_over_elements(const Mesh& mesh, int threads, const MakeSum& make_sum, const Add& add) {
  const auto elements = static_cast<int>(mesh.elements.size());
  const int block = std::max(8, (elements + 127) / 128);  // at most 128 partial sums in memory
  const int blocks = (elements + block - 1) / block;
  std::vector<MatrixXd> partial(static_cast<size_t>(blocks));
  parallel_for(threads, blocks, 1, [&](int b) {
    auto sum = make_sum();
    for (int e = b * block; e < std::min(elements, (b + 1) * block); ++e) add(e, sum);
    partial[static_cast<size_t>(b)] = sum.sum();
  });
  MatrixXd total = make_sum().sum();
  for (const MatrixXd& part : partial) total += part;
  return total;
}

/// Z^T M_s Z of a mesh of solids: there z = sum N_a z_a at every point (they are isoparametric), with z_a = (1, x_a,
/// shapes at the node), and M is the scalar mass matrix M_s three times.
MatrixXd gram_of_solids(const Mesh& mesh, const Assembly& assembly, const MatrixXd& Phi, int threads) {
  const Index nodes = mesh.nodes.cols(), size = 4 + 3 * Phi.cols();
  std::vector<int> node_of(static_cast<size_t>(assembly.dofs.count), -1);  // of each freedom ux
  std::vector<double> lumped(static_cast<size_t>(nodes), 0);  // mass of bodies, that are counted by their own points
  for (int a = 0; a < nodes; ++a) {
    if (assembly.dofs.freedoms_of(a) >= 3) node_of[static_cast<size_t>(assembly.dofs.of_node(a, 0))] = a;
  }
  for (const NodalBody& body : mesh.bodies) lumped[static_cast<size_t>(body.node)] += body.mass;

  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<size_t>(assembly.M.nonZeros() / 3));
  for (int j = 0; j < assembly.M.cols(); ++j) {
    const int b = node_of[static_cast<size_t>(j)];
    if (b < 0) continue;
    for (SparseMatrix::InnerIterator it(assembly.M, j); it; ++it) {
      const int a = node_of[static_cast<size_t>(it.row())];
      if (a < 0 || it.row() < j) continue;
      const double value = a == b ? it.value() - lumped[static_cast<size_t>(a)] : it.value();
      if (value != 0) entries.emplace_back(a, b, value);
    }
  }
  SparseMatrix M_s(nodes, nodes);
  M_s.setFromTriplets(entries.begin(), entries.end());

  MatrixXd Z = MatrixXd::Zero(nodes, size);
  Z.col(0).setOnes();
  Z.middleCols<3>(1) = mesh.nodes.transpose();
  for (int a = 0; a < nodes; ++a) {
    if (assembly.dofs.freedoms_of(a) < 3) continue;
    Z.row(a).tail(size - 4) = Phi.middleRows<3>(assembly.dofs.of_node(a, 0)).reshaped().transpose();
  }
  // A few columns of M_s Z at a time.
  MatrixXd gram(size, size);
  constexpr Index chunk = 16;
  const int chunks = static_cast<int>((size + chunk - 1) / chunk);
  parallel_for(threads, chunks, 1, [&](int c) {
    const Index first = c * chunk, cols = std::min(chunk, size - first);
    gram.middleCols(first, cols) = transposed_product(Z, symmetric_product(M_s, Z.middleCols(first, cols)));
  });
  return (gram + gram.transpose()) / 2;
}

}  // namespace

MatrixXd gram_matrix_by_points(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi, int threads) {
  const MatrixXd lower = sum_over_elements(
      mesh, threads, [&] { return GramSum(4 + 3 * Phi.cols()); },
      [&](int e, GramSum& gram) {
        const MatrixXd shapes = Phi(dofs.of_element(mesh, e), Eigen::all);
        const Element& element = mesh.elements[static_cast<size_t>(e)];
        add_points(gram, shapes, [&](const auto& visit) { type_of(element).mass_points(mesh, element, 0, visit); });
      });
  return MatrixXd(lower.selfadjointView<Eigen::Lower>()) + gram_of_bodies(mesh, dofs, Phi);
}

MatrixXd gram_matrix(const Mesh& mesh, const Assembly& assembly, const MatrixXd& Phi, int threads) {
  const bool solids = !mesh.elements.empty() && std::ranges::all_of(mesh.elements, [](const Element& e) {
    return type_of(e).shape != Shape::line;
  });
  if (!solids) return gram_matrix_by_points(mesh, assembly.dofs, Phi, threads);
  return gram_of_solids(mesh, assembly, Phi, threads) + gram_of_bodies(mesh, assembly.dofs, Phi);
}

MatrixXd reduced_stiffness(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi, int threads) {
  const MatrixXd lower = sum_over_elements(
      mesh, threads, [&] { return GramSum(Phi.cols(), 2048); },
      [&](int e, GramSum& sum) {
        const Element& element = mesh.elements[static_cast<size_t>(e)];
        sum.add(type_of(element).energy_strains(mesh, element, Phi(dofs.of_element(mesh, e), Eigen::all)));
      });
  return lower.selfadjointView<Eigen::Lower>();
}

}  // namespace flexboom
