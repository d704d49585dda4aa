#pragma once

// One version of a function for each generation of processors, chosen when the program starts. Not under sanitizers,
// which are not ready that early.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define FLEXBOOM_PROCESSORS
#define FLEXBOOM_FOR_EACH_PROCESSOR [[gnu::target_clones("avx512f", "avx2", "default")]]
#define FLEXBOOM_ANY_PROCESSOR [[gnu::target("default")]]  // beside versions written out for others
#else
#define FLEXBOOM_FOR_EACH_PROCESSOR
#define FLEXBOOM_ANY_PROCESSOR
#endif

namespace flexboom {

// A row of a few columns side by side: a vector register, or as many as the processor needs for it. `Anywhere` is one
// in memory that need not be aligned: a copy by memcpy goes through the stack in halves.
struct alignas(64) Eight {
  static constexpr int width = 8;
  using Anywhere [[gnu::vector_size(64), gnu::aligned(8), gnu::may_alias]] = double;
  double of [[gnu::vector_size(64)]];
};
struct alignas(32) Four {
  static constexpr int width = 4;
  using Anywhere [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;
  double of [[gnu::vector_size(32)]];
};
struct alignas(16) Two {
  static constexpr int width = 2;
  using Anywhere [[gnu::vector_size(16), gnu::aligned(8), gnu::may_alias]] = double;
  double of [[gnu::vector_size(16)]];
};

/// A longer row, in as many registers as the processor needs for it: compilers keep a vector type that is wider than a
/// register in memory.
template <class Register, int registers>
struct LaneRow {
  static constexpr int width = registers * Register::width;
  Register part[registers];
};

/// y += a x.
template <class Register, int registers>
[[gnu::always_inline]] inline void add(LaneRow<Register, registers>& y, double a,
                                       const LaneRow<Register, registers>& x) {
#pragma GCC unroll 4
  for (int p = 0; p < registers; ++p) y.part[p].of += a * x.part[p].of;
}

}  // namespace flexboom
