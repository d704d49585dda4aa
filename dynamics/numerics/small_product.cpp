#include "dynamics/numerics/small_product.hpp"

#include "fem/base/lanes.hpp"

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

struct Columns {
  const double* of;
  Index stride;
};
struct Factors {
  Columns A, B;
  double* C;
  Index stride_C, rows, inner;
};

/// `registers` of rows from `row` on, in `columns` columns of C from `column` on.
template <class Register, int registers, int columns>
[[gnu::always_inline]] inline void block(const Factors& f, Index row, Index column) {
  using Anywhere = typename Register::Anywhere;
  constexpr int width = Register::width;
  Register sum[columns][registers] = {};
  const double* a = f.A.of + row;
  const double* b = f.B.of + column * f.B.stride;
  for (Index k = 0; k < f.inner; ++k, a += f.A.stride, ++b) {
    Register part[registers];
#pragma GCC unroll 8
    for (Index r = 0; r < registers; ++r) part[r].of = *reinterpret_cast<const Anywhere*>(a + r * width);
#pragma GCC unroll 8
    for (int c = 0; c < columns; ++c)
#pragma GCC unroll 8
      for (int r = 0; r < registers; ++r) sum[c][r].of += b[c * f.B.stride] * part[r].of;
  }
#pragma GCC unroll 8
  for (int c = 0; c < columns; ++c)
#pragma GCC unroll 8
    for (Index r = 0; r < registers; ++r)
      *reinterpret_cast<Anywhere*>(f.C + (column + c) * f.stride_C + row + r * width) = sum[c][r].of;
}

/// All rows of `columns` columns; the last register of rows may overlap the one before it.
template <class Register, int registers, int columns>
[[gnu::always_inline]] inline void all_rows(const Factors& f, Index column) {
  constexpr Index width = Register::width, large = registers * width;
  Index row = 0;
  for (; row + large <= f.rows; row += large) block<Register, registers, columns>(f, row, column);
  if (row == f.rows) return;
  if (f.rows >= large && f.rows - row > large / 2)
    return block<Register, registers, columns>(f, f.rows - large, column);
  for (; row + width <= f.rows; row += width) block<Register, 1, columns>(f, row, column);
  if (row == f.rows) return;
  if (f.rows >= width) return block<Register, 1, columns>(f, f.rows - width, column);
  for (; row < f.rows; ++row)
    for (Index c = column; c < column + columns; ++c) {
      double sum = 0;
      for (Index k = 0; k < f.inner; ++k) sum += f.A.of[row + k * f.A.stride] * f.B.of[k + c * f.B.stride];
      f.C[row + c * f.stride_C] = sum;
    }
}

template <class Register, int registers>
[[gnu::always_inline]] inline void all_columns(const Factors& f, Index columns) {
  Index c = 0;
  for (; c + 4 <= columns; c += 4) all_rows<Register, registers, 4>(f, c);
  if (columns - c == 3) all_rows<Register, registers, 3>(f, c);
  if (columns - c == 2) all_rows<Register, 6, 2>(f, c);
  if (columns - c == 1) all_rows<Register, 6, 1>(f, c);
}

#ifdef FLEXBOOM_PROCESSORS
[[gnu::target("avx512f")]] void multiply(const Factors& f, Index columns) { all_columns<Eight, 3>(f, columns); }
[[gnu::target("avx2,fma")]] void multiply(const Factors& f, Index columns) { all_columns<Four, 2>(f, columns); }
#endif
FLEXBOOM_ANY_PROCESSOR void multiply(const Factors& f, Index columns) { all_columns<Two, 2>(f, columns); }

}  // namespace

void small_product(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const MatrixXd>& B, Eigen::Ref<MatrixXd> C) {
  multiply({{A.data(), A.outerStride()}, {B.data(), B.outerStride()}, C.data(), C.outerStride(), A.rows(), A.cols()},
           B.cols());
}

}  // namespace flexboom
