#include "fem/linear_algebra/supernodal_solve.hpp"

#include <cstddef>
#include <utility>

#define FLEXBOOM_INLINE [[gnu::always_inline]] inline  // into the function of each processor

namespace flexboom {
namespace {

using Index = std::ptrdiff_t;

/// y -= a x.
template <class Register, int registers>
FLEXBOOM_INLINE void subtract(LaneRow<Register, registers>& y, double a, const LaneRow<Register, registers>& x) {
#pragma GCC unroll 4
  for (int p = 0; p < registers; ++p) y.part[p].of -= a * x.part[p].of;
}

template <class Register, int registers>
FLEXBOOM_INLINE void scale(LaneRow<Register, registers>& y, double a) {
#pragma GCC unroll 4
  for (int p = 0; p < registers; ++p) y.part[p].of *= a;
}

/// Neighbouring columns of one block from the diagonal down. They are so few that their part of x stays in registers.
/// Every other row of x comes and goes once for all of them.
struct Panel {
  const double* value;  // of the diagonal entry of the first column
  Index stride;         // from column to column
  const int* row;       // of x
  Index rows;           // with those of the diagonal
};

/// 1 / L_jj of a panel, ahead of the chain of operations that waits for them.
template <int columns>
struct Inverses {
  double of[columns];
  FLEXBOOM_INLINE explicit Inverses(const Panel& L) {
#pragma GCC unroll 8
    for (int j = 0; j < columns; ++j) of[j] = 1 / L.value[j * L.stride + j];
  }
};

// While a panel is used, its neighbour comes near: the next in memory, or the one before.
FLEXBOOM_INLINE void fetch(const double* value) { __builtin_prefetch(value, 0, 2); }

template <int columns, class Row>
FLEXBOOM_INLINE void forward(const Panel& L, Row* x) {
  Row* const top = x + L.row[0];
  const Inverses<columns> inverse(L);
  Row x_J[columns];
#pragma GCC unroll 8
  for (int j = 0; j < columns; ++j) {
    x_J[j] = top[j];
#pragma GCC unroll 8
    for (int k = 0; k < j; ++k) subtract(x_J[j], L.value[k * L.stride + j], x_J[k]);
    scale(x_J[j], inverse.of[j]);
    top[j] = x_J[j];
  }
  for (Index i = columns; i < L.rows; ++i) {
    fetch(L.value + columns * (L.stride + i));
    Row x_i = x[L.row[i]];
#pragma GCC unroll 8
    for (int j = 0; j < columns; ++j) subtract(x_i, L.value[j * L.stride + i], x_J[j]);
    x[L.row[i]] = x_i;
  }
}

template <int columns, class Row>
FLEXBOOM_INLINE void backward(const Panel& L, Row* x) {
  Row* const top = x + L.row[0];
  const Inverses<columns> inverse(L);
  Row x_J[columns];
#pragma GCC unroll 8
  for (int j = 0; j < columns; ++j) x_J[j] = top[j];
  for (Index i = columns; i < L.rows; ++i) {
    fetch(L.value - columns * (L.stride - i));
    const Row x_i = x[L.row[i]];
#pragma GCC unroll 8
    for (int j = 0; j < columns; ++j) subtract(x_J[j], L.value[j * L.stride + i], x_i);
  }
#pragma GCC unroll 8
  for (int j = columns - 1; j >= 0; --j) {
#pragma GCC unroll 8
    for (int k = j + 1; k < columns; ++k) subtract(x_J[j], L.value[j * L.stride + k], x_J[k]);
    scale(x_J[j], inverse.of[j]);
    top[j] = x_J[j];
  }
}

/// Block `s` without its first `skipped` columns.
FLEXBOOM_INLINE Panel panel(const Supernodes& L, int s, Index skipped) {
  const Index rows = L.row_start[s + 1] - L.row_start[s];
  return {L.value + L.value_start[s] + skipped * (rows + 1), rows, L.row + L.row_start[s] + skipped, rows - skipped};
}

/// All blocks in panels of `columns` columns, and of `fewer` what is left of each.
template <int columns, class Row, int... fewer>
FLEXBOOM_INLINE void solve(const Supernodes& L, Row* x, std::integer_sequence<int, fewer...>) {
  for (int s = 0; s < L.count; ++s) {
    const Index all = L.column[s + 1] - L.column[s], rest = all % columns;
    for (Index j = 0; j + columns <= all; j += columns) forward<columns>(panel(L, s, j), x);
    ((rest == fewer + 1 ? forward<fewer + 1>(panel(L, s, all - rest), x) : void()), ...);
  }
  for (int s = L.count - 1; s >= 0; --s) {
    const Index all = L.column[s + 1] - L.column[s], rest = all % columns;
    ((rest == fewer + 1 ? backward<fewer + 1>(panel(L, s, all - rest), x) : void()), ...);
    for (Index j = all - rest; j > 0; j -= columns) backward<columns>(panel(L, s, j - columns), x);
  }
}

template <class Register, int columns, int width>
FLEXBOOM_INLINE void solve(const Supernodes& L, double* x) {
  using Rows = LaneRow<Register, width / Register::width>;
  solve<columns>(L, reinterpret_cast<Rows*>(x), std::make_integer_sequence<int, columns - 1>());
}

// A version for each generation of processors, chosen when the program starts: with as many columns as its registers
// have room for.
#ifdef FLEXBOOM_PROCESSORS
[[gnu::target("avx512f")]] void by_8(const Supernodes& L, double* x) { solve<Eight, 8, 8>(L, x); }
[[gnu::target("avx512f")]] void by_12(const Supernodes& L, double* x) { solve<Four, 8, 12>(L, x); }
[[gnu::target("avx512f")]] void by_16(const Supernodes& L, double* x) { solve<Eight, 8, 16>(L, x); }
[[gnu::target("avx2,fma")]] void by_8(const Supernodes& L, double* x) { solve<Four, 4, 8>(L, x); }
[[gnu::target("avx2,fma")]] void by_12(const Supernodes& L, double* x) { solve<Four, 4, 12>(L, x); }
[[gnu::target("avx2,fma")]] void by_16(const Supernodes& L, double* x) { solve<Four, 2, 16>(L, x); }
[[gnu::target("avx512f")]] int widest() { return 16; }
[[gnu::target("avx2,fma")]] int widest() { return 12; }
#endif
FLEXBOOM_ANY_PROCESSOR void by_8(const Supernodes& L, double* x) { solve<Two, 2, 8>(L, x); }
FLEXBOOM_ANY_PROCESSOR void by_12(const Supernodes& L, double* x) { solve<Two, 1, 12>(L, x); }
FLEXBOOM_ANY_PROCESSOR void by_16(const Supernodes& L, double* x) { solve<Two, 1, 16>(L, x); }
FLEXBOOM_ANY_PROCESSOR int widest() { return 12; }

}  // namespace

void solve_by_rows_of_8(const Supernodes& L, double* x) { by_8(L, x); }

void solve_by_rows_of_12(const Supernodes& L, double* x) { by_12(L, x); }

void solve_by_rows_of_16(const Supernodes& L, double* x) { by_16(L, x); }

int columns_at_once() { return widest(); }

}  // namespace flexboom
