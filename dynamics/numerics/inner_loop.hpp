#pragma once

/// An inner loop is compiled for any x86-64, for one with AVX2 and FMA, and for one with AVX-512. Four bodies side by
/// side fill the 32 registers of AVX-512. The loader picks by what the processor can do. The target "arch=haswell"
/// would ask for the processor's maker, too. Everything it calls is inlined, so that it is compiled as often.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define FLEXBOOM_INNER_LOOP __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"), flatten))
#else
#define FLEXBOOM_INNER_LOOP
#endif
