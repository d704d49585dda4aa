#include "fem/mesh/elastic_fields.hpp"

#include "fem/base/lanes.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom::elasticity {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// to = a x + b y + c z.
FLEXBOOM_FOR_EACH_PROCESSOR void combine(double a, const double* x, double b, const double* y, double c,
                                         const double* z, Index count, double* to) {
#pragma GCC ivdep
  for (Index i = 0; i < count; ++i) to[i] = a * x[i] + b * y[i] + c * z[i];
}

/// Six columns of scaled strains from nine of slopes, `count` long.
FLEXBOOM_FOR_EACH_PROCESSOR void scale_strains(const double* slopes, Index count, double normal, double dilatation,
                                               double shear, double* strains) {
#pragma GCC ivdep
  for (Index k = 0; k < count; ++k) {
    const auto g = [slopes, count, k](int column) { return slopes[column * count + k]; };
    const double trace = dilatation * (g(0) + g(4) + g(8));
    strains[k] = normal * g(0) + trace;
    strains[count + k] = normal * g(4) + trace;
    strains[2 * count + k] = normal * g(8) + trace;
    strains[3 * count + k] = shear * (g(1) + g(3));
    strains[4 * count + k] = shear * (g(5) + g(7));
    strains[5 * count + k] = shear * (g(6) + g(2));
  }
}

constexpr int points_at_once = 16;  // their strains of eight pairs stay in the first cache
constexpr int loads_at_once = 6;    // their sums stay in registers, twice as many too, which hides latencies

template <class Lanes>
[[gnu::always_inline]] inline Lanes lanes_at(const double* from) {
  return {*reinterpret_cast<const typename Lanes::Anywhere*>(from)};
}

/// Points with the slopes of shapes, `stride` long with zeros at the end, and stresses: 6 rows of `loads` per point.
struct PointBlock {
  int points;
  const double* slopes;
  int stride;
  const double* stresses;
  int loads;  // a multiple of loads_at_once
};

/// Work of the packed lower triangle, `pairs` long, per load.
struct PackedWork {
  int shapes;
  Index stride;  // from load to load
  int loads;
  double* value;
};

/// Second-order strains xx yy zz xy yz zx (engineering shear) of shape k with some shapes from l on, at one point.
template <class Lanes>
[[gnu::always_inline]] inline void set_second_order(const double* slopes, std::ptrdiff_t stride, std::ptrdiff_t k,
                                                    std::ptrdiff_t l, Lanes* strains) {
  double of_k[9];
  Lanes of_l[9];
#pragma GCC unroll 9
  for (std::ptrdiff_t i = 0; i < 9; ++i) {
    of_k[i] = slopes[i * stride + k];
    of_l[i] = lanes_at<Lanes>(slopes + i * stride + l);
  }
  const auto work = [&](std::ptrdiff_t i, std::ptrdiff_t j) __attribute__((always_inline)) {
    return of_k[3 * i] * of_l[3 * j].of + of_k[3 * i + 1] * of_l[3 * j + 1].of + of_k[3 * i + 2] * of_l[3 * j + 2].of;
  };
  strains[0].of = work(0, 0);
  strains[1].of = work(1, 1);
  strains[2].of = work(2, 2);
  strains[3].of = work(0, 1) + work(1, 0);
  strains[4].of = work(1, 2) + work(2, 1);
  strains[5].of = work(2, 0) + work(0, 2);
}

/// Adds the strains of some pairs times the stresses of the loads first .. first + count - 1.
template <int count, class Lanes>
[[gnu::always_inline]] inline void add_loads(const PointBlock& block, const Lanes* strains, int first, int lanes,
                                             const PackedWork& work, double* to) {
  Lanes sums[count] = {};
  for (std::ptrdiff_t s = 0; s < std::ptrdiff_t{6} * block.points; ++s) {
    const double* const stress = block.stresses + s * block.loads + first;
#pragma GCC unroll 12
    for (int c = 0; c < count; ++c) sums[c].of += strains[s].of * stress[c];
  }
  for (int c = 0; c < std::min(count, work.loads - first); ++c) {
    double* const at = to + (first + c) * work.stride;
    if (lanes == Lanes::width) {
      *reinterpret_cast<typename Lanes::Anywhere*>(at) += sums[c].of;
    } else {
      for (int lane = 0; lane < lanes; ++lane) at[lane] += sums[c].of[lane];
    }
  }
}

template <class Lanes>
[[gnu::always_inline]] inline void add_work_by(const PointBlock& block, const PackedWork& work) {
  Lanes strains[6 * points_at_once];
  double* row = work.value;  // of the pair (k, k)
  for (int k = 0; k < work.shapes; row += work.shapes - k, ++k) {
    for (int l = k; l < work.shapes; l += Lanes::width) {
      for (std::ptrdiff_t p = 0; p < block.points; ++p)
        set_second_order(block.slopes + 9 * p * block.stride, block.stride, k, l, strains + 6 * p);
      const int lanes = std::min(Lanes::width, work.shapes - l);
      int first = 0;
      for (; first + 2 * loads_at_once <= block.loads; first += 2 * loads_at_once)
        add_loads<2 * loads_at_once>(block, strains, first, lanes, work, row + (l - k));
      if (first < block.loads) add_loads<loads_at_once>(block, strains, first, lanes, work, row + (l - k));
    }
  }
}

#ifdef FLEXBOOM_PROCESSORS
[[gnu::target("avx512f")]] void add_work(const PointBlock& block, const PackedWork& work) {
  add_work_by<Eight>(block, work);
}
[[gnu::target("avx2,fma")]] void add_work(const PointBlock& block, const PackedWork& work) {
  add_work_by<Four>(block, work);
}
#endif
FLEXBOOM_ANY_PROCESSOR void add_work(const PointBlock& block, const PackedWork& work) { add_work_by<Two>(block, work); }

/// Stresses xx yy zz xy yz zx times the volume, in the columns 6 p + component.
MatrixXd stresses(const FieldSlopes& fields, const Lame& m, Index padded) {
  const Index points = fields.volumes.size();
  MatrixXd result = MatrixXd::Zero(padded, 6 * points);
  for (Index p = 0; p < points; ++p) {
    const auto g = fields.slopes.middleCols<9>(9 * p);
    auto s = result.middleCols<6>(6 * p).topRows(g.rows());
    const double volume = fields.volumes(p);
    const Eigen::VectorXd trace = volume * m.lambda * (g.col(0) + g.col(4) + g.col(8));
    for (Index i = 0; i < 3; ++i) s.col(i) = 2 * volume * m.mu * g.col(4 * i) + trace;
    s.col(3) = volume * m.mu * (g.col(1) + g.col(3));
    s.col(4) = volume * m.mu * (g.col(5) + g.col(7));
    s.col(5) = volume * m.mu * (g.col(6) + g.col(2));
  }
  return result;
}

}  // namespace

MatrixXd fields_of(const Eigen::Ref<const MatrixXd>& q) {
  const Index nodes = q.rows() / 3, k = q.cols();
  MatrixXd fields(nodes, 3 * k);
  for (Index c = 0; c < k; ++c) {
    const double* const of_c = q.col(c).data();
    for (Index i = 0; i < 3; ++i) {
      double* const to = &fields(0, k * i + c);
      for (Index a = 0; a < nodes; ++a) to[a] = of_c[3 * a + i] - of_c[i];
    }
  }
  return fields;
}

void FieldSlopes::set(Index p, double volume, const Eigen::Matrix3d& G, const std::array<const double*, 3>& r) {
  volumes(p) = volume;
  const Index count = 3 * slopes.rows();
  for (Index i = 0; i < 3; ++i) combine(G(0, i), r[0], G(1, i), r[1], G(2, i), r[2], count, &slopes(0, 9 * p + 3 * i));
}

MatrixXd energy_strains(const FieldSlopes& fields, const Lame& m) {
  // 2 mu I + lambda (1 1^T) = (a I + b 1 1^T)^2
  const double a = std::sqrt(2 * m.mu), b = (std::sqrt(2 * m.mu + 3 * m.lambda) - a) / 3, c = std::sqrt(m.mu);
  const Index points = fields.volumes.size();
  MatrixXd strains(fields.slopes.rows(), 6 * points);
  for (Index p = 0; p < points; ++p) {
    const double root = std::sqrt(fields.volumes(p));
    scale_strains(&fields.slopes(0, 9 * p), strains.rows(), root * a, root * b, root * c, &strains(0, 6 * p));
  }
  return strains;
}

void add_prestress_work(const FieldSlopes& prestress, const FieldSlopes& shapes, const Lame& lame,
                        Eigen::Ref<MatrixXd> work) {
  const Index count = shapes.slopes.rows(), loads = prestress.slopes.rows(), points = shapes.volumes.size();
  if (count == 0 || loads == 0) return;
  const Index padded = (loads + loads_at_once - 1) / loads_at_once * loads_at_once;
  const MatrixXd stress = stresses(prestress, lame, padded);
  MatrixXd slopes = MatrixXd::Zero(count + Eight::width - 1, Index{9} * points_at_once);
  for (Index first = 0; first < points; first += points_at_once) {
    const Index some = std::min<Index>(points_at_once, points - first);
    slopes.topLeftCorner(count, 9 * some) = shapes.slopes.middleCols(9 * first, 9 * some);
    add_work({static_cast<int>(some), slopes.data(), static_cast<int>(slopes.rows()), &stress(0, 6 * first),
              static_cast<int>(padded)},
             {static_cast<int>(count), work.outerStride(), static_cast<int>(loads), work.data()});
  }
}

}  // namespace flexboom::elasticity
