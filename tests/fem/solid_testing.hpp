#pragma once

#include "fem/mesh/shape_functions.hpp"
#include "fem_testing.hpp"

#include <Eigen/SparseCholesky>

#include <array>
#include <map>

// Solid bodies of one or many elements, and a plain eigen-solve that shares nothing with the library but K and M.
namespace flexboom::testing {

inline bool is_solid(const ElementType& type) { return type.shape != Shape::line; }

/// A row of the table in one of its orders, and its name as a parameter of tests.
struct Row {
  size_t type = 0;
  int order = 1;
};
inline void PrintTo(const Row& row, std::ostream* out) { *out << element_types()[row.type].name << " " << row.order; }
inline std::string row_name(const ElementType& type, int order) {
  std::string name(type.name);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name + "_order_" + std::to_string(order);
}
inline std::string name_of_row(const ::testing::TestParamInfo<Row>& info) {
  return row_name(element_types()[info.param.type], info.param.order);
}

/// A valid, smoothly distorted image of [-1, 1]^3 of 0.2 m, off the origin.
inline Eigen::Vector3d distort(const Eigen::Vector3d& x) {
  return {0.7 + 0.11 * x(0) + 0.02 * x(1) + 0.012 * x(0) * x(1), -0.3 + 0.09 * x(1) - 0.01 * x(2) + 0.008 * x(1) * x(2),
          1.1 + 0.13 * x(2) + 0.013 * x(0) * x(2) + 0.01 * x.prod()};
}

/// Reference positions of the nodes of a solid row.
inline Eigen::Matrix3Xd reference_nodes(const ElementType& type, int order) {
  const Eigen::Index count = type.node_count(order);
  if (type.shape == Shape::tetrahedron) return tetrahedron_nodes().leftCols(count);
  if (type.shape == Shape::wedge) return wedge_nodes().leftCols(count);
  if (type.name != "hex") return hexahedron_nodes().leftCols(count);
  const Eigen::VectorXd& line = lobatto_basis(order).nodes();
  const Eigen::Index n = line.size();
  Eigen::Matrix3Xd nodes(3, count);
  for (Eigen::Index a = 0; a < count; ++a) nodes.col(a) << line(a % n), line(a / n % n), line(a / (n * n));
  return nodes;
}

using Map3 = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

/// One solid element whose nodes are the images of the reference nodes.
inline Mesh one_solid(const ElementType& type, int order, const Map3& map, const Material& material = aluminium) {
  const Eigen::Matrix3Xd reference = reference_nodes(type, order);
  Mesh mesh;
  mesh.nodes.resize(3, reference.cols());
  Element element{element_type(type.name), {}, order, 0};
  for (Eigen::Index a = 0; a < reference.cols(); ++a) {
    mesh.nodes.col(a) = map(reference.col(a));
    element.nodes.push_back(static_cast<int>(a));
  }
  mesh.elements.push_back(element);
  mesh.solid_properties.push_back({"solid", material});
  return mesh;
}

/// Pieces of the cube [-1, 1]^3 that rows of a shape fill: per piece, reference point -> cube.
inline std::vector<Map3> pieces_of_cube(Shape shape) {
  if (shape == Shape::hexahedron) return {[](const Eigen::Vector3d& x) { return x; }};
  std::vector<Map3> pieces;
  if (shape == Shape::wedge) {
    for (const double side : {1.0, -1.0}) {
      pieces.push_back([side](const Eigen::Vector3d& x) {
        return Eigen::Vector3d(side * (2 * x(0) - 1), side * (2 * x(1) - 1), x(2));
      });
    }
    return pieces;
  }
  // Kuhn's six tetrahedra along the diagonal: one per permutation of the axes.
  std::array<int, 3> axes = {0, 1, 2};
  do {
    Eigen::Matrix3d corners = Eigen::Matrix3d::Zero();  // columns: corners 1, 2, 3 of the unit cube
    for (int k = 0; k < 3; ++k) {
      for (int l = k; l < 3; ++l) corners(axes[static_cast<size_t>(k)], l) = 1;
    }
    if (corners.determinant() < 0) corners.col(0).swap(corners.col(1));
    pieces.push_back([corners](const Eigen::Vector3d& x) { return Eigen::Vector3d(2 * (corners * x).array() - 1); });
  } while (std::next_permutation(axes.begin(), axes.end()));
  return pieces;
}

/// Adds an element whose nodes are the images of the reference nodes; nodes at one place (to `same`) are one.
class SolidBuilder {
 public:
  explicit SolidBuilder(const Material& material, double same = 1e-9) : same_(same) {
    mesh_.solid_properties.push_back({"solid", material});
  }

  void add(const ElementType& type, int order, const Map3& map) {
    const Eigen::Matrix3Xd reference = reference_nodes(type, order);
    Element element{element_type(type.name), {}, order, 0};
    for (Eigen::Index a = 0; a < reference.cols(); ++a) element.nodes.push_back(node(map(reference.col(a))));
    mesh_.elements.push_back(std::move(element));
  }

  Mesh take() {
    mesh_.nodes.resize(3, std::ssize(positions_));
    for (Eigen::Index i = 0; i < mesh_.nodes.cols(); ++i) mesh_.nodes.col(i) = positions_[static_cast<size_t>(i)];
    return std::move(mesh_);
  }

 private:
  int node(const Eigen::Vector3d& x) {
    // Half a cell off the origin, so that round numbers do not fall on the border of two cells.
    std::array<long, 3> key{};
    for (size_t d = 0; d < 3; ++d)
      key[d] = static_cast<long>(std::floor(x(static_cast<Eigen::Index>(d)) / same_ + 0.37));
    const auto [found, is_new] = numbers_.try_emplace(key, static_cast<int>(positions_.size()));
    if (is_new) positions_.push_back(x);
    return found->second;
  }

  double same_;
  Mesh mesh_;
  std::vector<Eigen::Vector3d> positions_;
  std::map<std::array<long, 3>, int> numbers_;
};

/// Shape functions of the corners of a shape.
inline Eigen::VectorXd corner_values(Shape shape, const Eigen::Vector3d& x) {
  if (shape == Shape::tetrahedron) return tet4_shapes(x).values;
  return shape == Shape::wedge ? wedge6_shapes(x).values : hex8_shapes(x).values;
}

/// The map of an element with the corners of `map` and straight edges.
inline Map3 straight(Shape shape, const Map3& map) {
  const Eigen::Index count = shape == Shape::hexahedron ? 8 : shape == Shape::wedge ? 6 : 4;
  const Eigen::Matrix3Xd& reference = shape == Shape::hexahedron ? hexahedron_nodes()
                                      : shape == Shape::wedge    ? wedge_nodes()
                                                                 : tetrahedron_nodes();
  Eigen::Matrix3Xd corners(3, count);
  for (Eigen::Index a = 0; a < count; ++a) corners.col(a) = map(reference.col(a));
  return [corners, shape](const Eigen::Vector3d& x) { return Eigen::Vector3d(corners * corner_values(shape, x)); };
}

/// A box of nx x ny x nz cells on [0, 1]^3 carried by `map`.
inline Mesh box(const ElementType& type, int order, const std::array<int, 3>& cells, const Map3& map,
                const Material& material = aluminium) {
  SolidBuilder builder(material);
  const Eigen::Vector3d size(1.0 / cells[0], 1.0 / cells[1], 1.0 / cells[2]);
  for (int c = 0; c < cells[0] * cells[1] * cells[2]; ++c) {
    const Eigen::Vector3d cell(c % cells[0], c / cells[0] % cells[1], c / (cells[0] * cells[1]));
    for (const Map3& piece : pieces_of_cube(type.shape)) {
      builder.add(type, order, [&](const Eigen::Vector3d& x) {
        return map((cell + (piece(x).array() + 1).matrix() / 2).cwiseProduct(size));
      });
    }
  }
  return builder.take();
}

inline Map3 stretch(double x, double y, double z) {
  return [x, y, z](const Eigen::Vector3d& u) { return Eigen::Vector3d(x * u(0), y * u(1), z * u(2)); };
}

/// K^-1 of a sparse matrix, or of one that is nearly full as that of a few elements of high order is.
class PlainInverse {
 public:
  explicit PlainInverse(const SparseMatrix& K)
      : full_(double(K.nonZeros()) > 0.1 * double(K.rows()) * double(K.rows())) {
    if (full_) {
      dense_.compute(Eigen::MatrixXd(K));
    } else {
      sparse_.compute(K);
    }
    EXPECT_EQ(full_ ? dense_.info() : sparse_.info(), Eigen::Success);
  }
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& X) const {
    return full_ ? Eigen::MatrixXd(dense_.solve(X)) : Eigen::MatrixXd(sparse_.solve(X));
  }

 private:
  bool full_;
  Eigen::LLT<Eigen::MatrixXd> dense_;
  Eigen::SimplicialLLT<SparseMatrix> sparse_;
};

/// Lowest `count` frequencies [Hz] of K phi = omega^2 M phi on the listed freedoms, by subspace iteration with K +
/// shift M (shift > 0 where the body is free) and Rayleigh quotients of strain energies of the elements.
inline std::vector<double> solid_frequencies_hz(const Mesh& mesh, const std::vector<int>& dofs, int count,
                                                double shift = 0) {
  const Assembly a = assemble(mesh);
  SparseMatrix pick(a.dofs.count, std::ssize(dofs));
  for (size_t i = 0; i < dofs.size(); ++i) pick.insert(dofs[i], static_cast<Eigen::Index>(i)) = 1;
  const SparseMatrix K_full = a.K.selfadjointView<Eigen::Lower>(), M_full = a.M.selfadjointView<Eigen::Lower>();
  const SparseMatrix M = pick.transpose() * M_full * pick;
  const SparseMatrix K = SparseMatrix(pick.transpose() * K_full * pick) + shift * M;
  const PlainInverse inverse(K);
  std::srand(5);
  const Eigen::Index block = std::min<Eigen::Index>(count + 6, K.cols());
  Eigen::MatrixXd X = Eigen::MatrixXd::Random(K.cols(), block);
  Eigen::VectorXd last = Eigen::VectorXd::Zero(block);
  // Values settle to the round-off of an ill-conditioned K; vectors gain more in the steps after.
  for (int after = 0, iteration = 0; after < 4 && iteration < 80; ++iteration) {
    X = inverse(M * X);
    const Eigen::MatrixXd MX = M * X, KX = K * X;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> ritz(X.transpose() * MX, X.transpose() * KX);
    X = (X * ritz.eigenvectors()).rowwise().reverse();
    const Eigen::VectorXd values = ritz.eigenvalues().reverse();
    after += (values - last).head(count).cwiseAbs().maxCoeff() < 1e-8 * values(0);
    last = values;
  }
  const PointEnergies energy = point_energies(mesh, a, pick * X.leftCols(count));
  std::vector<double> frequencies;
  for (int k = 0; k < count; ++k) frequencies.push_back(std::sqrt(energy.strain(k) / energy.kinetic(k)) / (2 * pi));
  std::sort(frequencies.begin(), frequencies.end());
  return frequencies;
}

/// Freedoms of a solid mesh less those that `held` names: held(position, component).
inline std::vector<int> free_of(const Mesh& mesh, const std::function<bool(const Eigen::Vector3d&, int)>& held) {
  std::vector<int> dofs;
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    for (int k = 0; k < 3; ++k) {
      if (!held(mesh.nodes.col(node), k)) dofs.push_back(3 * node + k);
    }
  }
  return dofs;
}

}  // namespace flexboom::testing
