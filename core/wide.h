#pragma once
// Kernels for wide registers.

/// For kernels on rows and blocks: also compiled for AVX-512 and AVX2, chosen when the program starts. Contraction is
/// off, so all give the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PAVEL_WIDE __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define PAVEL_WIDE
#endif
/// Before the short loops of such kernels: GCC would unroll them first, and then not vectorise.
#if defined(__GNUC__) && !defined(__clang__)
#define PAVEL_ROLLED _Pragma("GCC unroll 1")
#else
#define PAVEL_ROLLED
#endif
