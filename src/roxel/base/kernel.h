#pragma once
/// ROXEL_KERNEL marks inner loops that are compiled twice and chosen at load time where the compiler can:
/// once for every x86-64, once for AVX2 and FMA.

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define ROXEL_KERNEL __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define ROXEL_KERNEL
#endif
