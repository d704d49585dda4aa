#include "fem/base/heap.hpp"

#include <SuiteSparse_config.h>

#include <cstdlib>
#include <memory>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace flexboom {

#ifdef __linux__
namespace {

constexpr std::size_t huge_page = std::size_t{2} << 20;

void* allocate(std::size_t bytes) {
  void* const block = std::malloc(bytes);
  if (!block || bytes < 32 * huge_page) return block;
  void* first = block;
  std::size_t left = bytes;
  if (std::align(huge_page, huge_page, first, left))
    madvise(first, left / huge_page * huge_page, MADV_HUGEPAGE);  // a wish: where it is refused, small pages do
  return block;
}

}  // namespace
#endif

void factors_on_huge_pages() {
#ifdef __linux__
  SuiteSparse_config.malloc_func = allocate;
#endif
}

void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int mebibyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 256 * mebibyte);
  mallopt(M_TRIM_THRESHOLD, 512 * mebibyte);
#endif
}

void return_freed_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace flexboom
