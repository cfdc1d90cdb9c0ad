#pragma once
/// The instruction sets that kernels written with Highway are compiled for: AVX-512, AVX2 with FMA, SSE4, and
/// none at all. To be included before hwy/foreach_target.h.

#define HWY_DISABLED_TARGETS HWY_SSSE3
