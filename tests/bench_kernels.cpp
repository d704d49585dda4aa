// What is computed here beside the library that could do it: orders of elimination beside those of CHOLMOD, small
// products beside those of Eigen.

#include "dynamics/numerics/small_product.hpp"
#include "fem/linear_algebra/ordering.hpp"

#include <benchmark/benchmark.h>
#include <cholmod.h>
#include <Eigen/Dense>

#include <algorithm>
#include <vector>

namespace {

using namespace flexboom;
using Eigen::MatrixXd;

/// Pattern of the stiffness of nx x ny x nz hexahedra of eight nodes, three freedoms each; lower triangle.
SparseMatrix hexahedra(int nx, int ny, int nz) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto node = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  const auto add_node = [&](int i, int j, int k) {
    const int a = node(i, j, k);
    for (int z = std::max(k - 1, 0); z <= std::min(k + 1, nz); ++z)
      for (int y = std::max(j - 1, 0); y <= std::min(j + 1, ny); ++y)
        for (int x = std::max(i - 1, 0); x <= std::min(i + 1, nx); ++x)
          for (int entry = 0; entry < 9; ++entry) {
            const int row = 3 * a + entry / 3, column = 3 * node(x, y, z) + entry % 3;
            if (row >= column) entries.emplace_back(row, column, 1);
          }
  };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) add_node(i, j, k);
  const int size = 3 * (nx + 1) * (ny + 1) * (nz + 1);
  SparseMatrix A(size, size);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

SparseMatrix body(const benchmark::State& state) {
  return hexahedra(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)),
                   static_cast<int>(state.range(2)));
}

void set_counters(benchmark::State& state, const SparseMatrix& A, double nonzeros, double flops) {
  state.counters["unknowns"] = static_cast<double>(A.cols());
  state.counters["nonzeros"] = nonzeros;
  state.counters["flops"] = flops;
}

void Order(benchmark::State& state) {
  const SparseMatrix A = body(state);
  Ordering order;
  for (auto _ : state) order = fill_reducing_ordering(A);
  state.SetLabel(order.name);
  set_counters(state, A, order.nonzeros, order.flops);
}

/// METIS alone, or the default of CHOLMOD: minimum degree, and METIS where that fills much.
void analyse(benchmark::State& state, bool metis_alone) {
  SparseMatrix A = body(state);
  cholmod_common common;
  cholmod_start(&common);
  if (metis_alone) {
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
  }
  cholmod_sparse view{};
  view.nrow = view.ncol = static_cast<size_t>(A.cols());
  view.nzmax = static_cast<size_t>(A.nonZeros());
  view.p = A.outerIndexPtr();
  view.i = A.innerIndexPtr();
  view.x = A.valuePtr();
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  for (auto _ : state) {
    cholmod_factor* L = cholmod_analyze(&view, &common);
    cholmod_free_factor(&L, &common);
  }
  set_counters(state, A, common.lnz, common.fl);
  cholmod_finish(&common);
}
void OrderByMetisOfCholmod(benchmark::State& state) { analyse(state, true); }
void OrderByCholmod(benchmark::State& state) { analyse(state, false); }

void bodies(benchmark::internal::Benchmark* b) {
  b->Args({4, 4, 100})->Args({8, 8, 60})->Args({40, 40, 2})->Args({16, 16, 16})->Unit(benchmark::kMillisecond);
}
BENCHMARK(Order)->Apply(bodies);
BENCHMARK(OrderByMetisOfCholmod)->Apply(bodies);
BENCHMARK(OrderByCholmod)->Apply(bodies);

/// Square A times eight columns, as the exponential integrator changes between states and modes.
struct Factors {
  explicit Factors(Eigen::Index size) : A(MatrixXd::Random(size, size)), B(MatrixXd::Random(size, 8)), C(size, 8) {}
  MatrixXd A, B, C;
};
void SmallProduct(benchmark::State& state) {
  Factors f(state.range(0));
  for (auto _ : state) {
    small_product(f.A, f.B, f.C);
    benchmark::DoNotOptimize(f.C.data());
    benchmark::ClobberMemory();
  }
}
void ProductByEigen(benchmark::State& state) {
  Factors f(state.range(0));
  for (auto _ : state) {
    f.C.noalias() = f.A * f.B;
    benchmark::DoNotOptimize(f.C.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(SmallProduct)->Arg(22)->Arg(38)->Arg(86)->Arg(200)->Arg(400);
BENCHMARK(ProductByEigen)->Arg(22)->Arg(38)->Arg(86)->Arg(200)->Arg(400);

}  // namespace
