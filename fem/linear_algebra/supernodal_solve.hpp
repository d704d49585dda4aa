#pragma once

#include "fem/base/lanes.hpp"

namespace flexboom {

/// L of L L^T as CHOLMOD keeps it in dense blocks. Block s has the columns [column[s], column[s + 1]) and the rows
/// row[row_start[s] ...], the first of which are those columns themselves. Its entries lie column by column from
/// value[value_start[s]]. What is above the diagonal is unused.
struct Supernodes {
  int count;
  const int* column;
  const int* row_start;
  const int* value_start;
  const int* row;
  const double* value;
};

/// x = (L L^T)^-1 x in place for eight right-hand sides kept row by row, each row at a multiple of 64 bytes: L is read
/// once from its first entry to its last, and once back.
void solve_by_rows_of_8(const Supernodes& L, double* x);

/// The same for more at once.
void solve_by_rows_of_12(const Supernodes& L, double* x);
void solve_by_rows_of_16(const Supernodes& L, double* x);

/// The most right-hand sides that cost less together than apart: 16 on processors with AVX-512, else 12. With AVX2
/// 12 take 1.2 times as long as 8, and 16 take 1.8 times: a row of x and its part above no longer fit the registers.
int columns_at_once();

}  // namespace flexboom
