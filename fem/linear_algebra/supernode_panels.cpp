#include "fem/linear_algebra/supernode_panels.hpp"

#include "fem/base/check.hpp"

#include <algorithm>
#include <vector>

namespace flexboom {
namespace {

const int* ints(const void* array) { return static_cast<const int*>(array); }

/// The arrays of a supernodal CHOLMOD factor: columns super[s] .. super[s + 1] have the rows s[pi[s] .. pi[s + 1]),
/// their own first, and values from px[s] on.
struct Blocks {
  std::vector<int> super{0}, pi{0}, px{0}, rows;

  void add(int columns, const int* first, const int* last) {
    super.push_back(super.back() + columns);
    rows.insert(rows.end(), first, last);
    pi.push_back(static_cast<int>(rows.size()));
    px.push_back(px.back() + columns * static_cast<int>(last - first));
  }
};

struct WorkSizes {
  size_t update = 1;  // entries of the largest update of one block by another
  size_t rows = 1;    // most rows below a block
};

WorkSizes work_sizes(const Blocks& blocks) {
  std::vector<int> block_of(static_cast<size_t>(blocks.super.back()));
  for (size_t s = 0; s + 1 < blocks.super.size(); ++s)
    std::fill(block_of.begin() + blocks.super[s], block_of.begin() + blocks.super[s + 1], static_cast<int>(s));
  WorkSizes sizes;
  for (size_t s = 0; s + 1 < blocks.super.size(); ++s) {
    const int last = blocks.pi[s + 1];
    int p = blocks.pi[s] + blocks.super[s + 1] - blocks.super[s];
    sizes.rows = std::max(sizes.rows, static_cast<size_t>(last - p));
    while (p < last) {
      const int first = p;
      const auto block = [&](int k) { return block_of[static_cast<size_t>(blocks.rows[static_cast<size_t>(k)])]; };
      while (p < last && block(p) == block(first)) ++p;
      sizes.update = std::max(sizes.update, static_cast<size_t>(p - first) * static_cast<size_t>(last - first));
    }
  }
  return sizes;
}

/// Splits every block in equal panels.
Blocks panels(const cholmod_factor& L, int width) {
  const int *super = ints(L.super), *pi = ints(L.pi), *rows = ints(L.s);
  Blocks blocks;
  for (size_t s = 0; s < L.nsuper; ++s) {
    const int columns = super[s + 1] - super[s];
    const int count = (columns + width - 1) / width;
    for (int k = 0; k < count; ++k) {
      const int first = columns * k / count, last = columns * (k + 1) / count;
      blocks.add(last - first, rows + pi[s] + first, rows + pi[s + 1]);
    }
  }
  return blocks;
}

}  // namespace

void split_into_panels(cholmod_factor& L, int width, cholmod_common& common) {
  const Blocks blocks = panels(L, width);
  const WorkSizes sizes = work_sizes(blocks);
  const auto replace = [&](void*& array, size_t old_count, const std::vector<int>& values) {
    void* copy = cholmod_malloc(values.size(), sizeof(int), &common);  // CHOLMOD frees it with the factor
    if (copy == nullptr) throw NumericalError("sparse analysis: out of memory");
    std::copy(values.begin(), values.end(), static_cast<int*>(copy));
    cholmod_free(old_count, sizeof(int), array, &common);
    array = copy;
  };
  const size_t ends = L.nsuper + 1;
  replace(L.super, ends, blocks.super);
  replace(L.pi, ends, blocks.pi);
  replace(L.px, ends, blocks.px);
  replace(L.s, L.ssize, blocks.rows);
  L.nsuper = blocks.super.size() - 1;
  L.ssize = blocks.rows.size();
  L.xsize = static_cast<size_t>(blocks.px.back());
  L.maxcsize = sizes.update;
  L.maxesize = sizes.rows;
}

}  // namespace flexboom
