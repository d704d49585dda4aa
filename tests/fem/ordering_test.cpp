#include "fem/linear_algebra/ordering.hpp"

#include "fem/linear_algebra/quotient_graph.hpp"

#include "box_matrix.hpp"

#include <algorithm>

namespace flexboom::testing {
namespace {

using Eigen::MatrixXd;

/// Entries of the Cholesky factor of a dense pattern, eliminated one by one.
double dense_fill(const SparseMatrix& A, const std::vector<int>& permutation) {
  const MatrixXd P = full(A)(permutation, permutation);
  Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic> L = P.array() != 0;
  double entries = 0;
  for (Eigen::Index j = 0; j < L.cols(); ++j) {
    for (Eigen::Index i = j; i < L.rows(); ++i) {
      if (!L(i, j)) continue;
      ++entries;
      for (Eigen::Index k = j + 1; k <= i; ++k) L(i, k) = L(i, k) || L(k, j);
    }
  }
  return entries;
}

TEST(Ordering, CountsTheFillOfItsPermutation) {
  const SparseMatrix A = box(3, 4, 5, 1);
  const Ordering order = fill_reducing_ordering(A);
  std::vector<int> sorted = order.permutation;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < A.cols(); ++i) ASSERT_EQ(sorted[static_cast<size_t>(i)], i) << "not a permutation";
  EXPECT_EQ(order.nonzeros, dense_fill(A, order.permutation));
  EXPECT_GT(order.flops, order.nonzeros);
}

TEST(Ordering, LikeFreedomsOfANodeStayTogether) {
  const Ordering order = fill_reducing_ordering(box(3, 4, 5, 1));
  for (size_t k = 0; k < order.permutation.size(); k += 3)
    EXPECT_EQ(order.permutation[k] / 3, order.permutation[k + 2] / 3);
}

TEST(Ordering, OfASlenderBodyIsNoWorseThanItsBand) {
  const SparseMatrix A = box(5, 5, 60, 1);
  const Ordering order = fill_reducing_ordering(A);
  const double band = 3 * 26;  // node numbers run along the bar: a band of one layer
  EXPECT_LE(order.nonzeros, band * static_cast<double>(A.cols()));
}

// Large enough that all orders are tried.
TEST(Ordering, CountsLargeFactorsAsTheDenseOracle) {
  const SparseMatrix A = box(4, 4, 45, 1);
  const Ordering order = fill_reducing_ordering(A);
  EXPECT_EQ(order.nonzeros, dense_fill(A, order.permutation)) << order.name;
}

TEST(Ordering, OrdersPartsThatDoNotTouch) {
  SparseMatrix A = box(6, 6, 30, 1);
  A.prune([](Eigen::Index row, Eigen::Index column, double) { return (row < 1800) == (column < 1800); });
  std::vector<int> sorted = fill_reducing_ordering(A).permutation;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < A.cols(); ++i) ASSERT_EQ(sorted[static_cast<size_t>(i)], i) << "not a permutation";
}

/// Levels of a bar are its cross-sections, from whichever node the search starts.
TEST(Ordering, WalksAlongASlenderBody) {
  const QuotientGraph graph = quotient_graph(box(4, 5, 40, 1));
  const Levels levels = levels_along(graph);
  EXPECT_GE(levels.count, 40);
  EXPECT_EQ(levels.order.size(), graph.weight.size());
  for (int g = 0; g < graph.size(); ++g) {
    for (int e = graph.start[static_cast<size_t>(g)]; e < graph.start[static_cast<size_t>(g) + 1]; ++e) {
      const auto other = static_cast<size_t>(graph.neighbour[static_cast<size_t>(e)]);
      EXPECT_LE(std::abs(levels.level[static_cast<size_t>(g)] - levels.level[other]), 1);
    }
  }
}

TEST(Ordering, TheFreedomsOfANodeAreOneGroup) {
  const QuotientGraph graph = quotient_graph(box(3, 4, 5, 1));
  EXPECT_EQ(graph.weight, std::vector<int>(60, 3));
}

/// Pattern of a bar of trilinear elements, three freedoms a node: each couples with the 26 nodes around it.
SparseMatrix bar_of_elements(int width, int length) {
  std::vector<Eigen::Triplet<double>> triplets;
  const int nodes = width * width * length;
  const auto near = [&](int a, int b) {
    return std::abs(a % width - b % width) <= 1 && std::abs(a / width % width - b / width % width) <= 1;
  };
  for (int a = 0; a < nodes; ++a) {
    for (int layer = 0; layer <= 1; ++layer) {
      const int centre = a + layer * width * width;
      for (int b = std::max(a, centre - width - 1); b <= std::min(nodes - 1, centre + width + 1); ++b) {
        if (b / (width * width) != a / (width * width) + layer || !near(a, b)) continue;
        for (int entry = 0; entry < 9; ++entry) triplets.emplace_back(3 * b + entry / 3, 3 * a + entry % 3, 1);
      }
    }
  }
  SparseMatrix A(3 * nodes, 3 * nodes);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A.triangularView<Eigen::Lower>();
}

// One layer w of unknowns is the front of a band: n w^2 multiplications. Measured:
// band 1.19, slices 1.15, dissection 1.36, minimum degree 3.3 times that.
TEST(Ordering, OfALongBarTakesLessWorkThanItsBand) {
  const int width = 12;
  const SparseMatrix A = bar_of_elements(width, 80);
  const double w = 3 * width * width, n = static_cast<double>(A.cols());
  EXPECT_LT(fill_reducing_ordering(A).flops, 1.25 * n * w * w);
}

// As long as a slender body by the walk through it. Minimum degree takes 4.22e8, slices 6.73e8.
TEST(Ordering, OfAThinPlateIsThatOfMinimumDegree) { EXPECT_LT(fill_reducing_ordering(box(41, 41, 3, 1)).flops, 4.5e8); }

}  // namespace
}  // namespace flexboom::testing
