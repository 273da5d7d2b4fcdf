/* What all kernels share: how they are seen from outside, processors they are compiled for, and four numbers at a time.

Arrays lie row by row, as NumPy's do; sizes are int64_t. Kernels return 0, or as each says. */
#ifndef FLEXURA_H
#define FLEXURA_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* seen from outside, and made a second time for processors with AVX2 and FMA, chosen when the library is loaded */
#if defined(_WIN32)
#define KERNEL __declspec(dllexport)
#elif defined(__x86_64__) && defined(__linux__) && (__GNUC__ >= 12 || __clang_major__ >= 17)
#define KERNEL __attribute__((target_clones("arch=x86-64-v3", "default")))
#define SHARED static KERNEL
#else
#define KERNEL
#endif

/* called by several kernels, where it would be too long as a part of each */
#ifndef SHARED
#define SHARED static
#endif

/* part of each kernel that uses it, compiled for the same processors */
#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

typedef double four __attribute__((vector_size(32), aligned(8)));

#define AT(array, i) (*(const four *)((array) + (i)))
#define PUT(array, i) (*(four *)((array) + (i)))

#endif
