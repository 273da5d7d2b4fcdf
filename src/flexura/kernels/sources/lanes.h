/* Small matrices of four designs at a time, one in each lane. All of it is compiled into the kernels that use it. */
#ifndef LANES_H
#define LANES_H

#include "flexura.h"

/* no function of these stands by itself, so that how they would be passed does not matter */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

#define EPS 2.220446049250313e-16
/* numbers of four designs, which lie where the processor reads them at once */
typedef double lanes __attribute__((vector_size(32)));

#define LANES static inline __attribute__((always_inline))

/* Scratch from its first line of the cache on; callers give eight numbers more. */
LANES lanes *aligned(double *scratch)
{
    return (lanes *)(((uintptr_t)scratch + 63) & ~(uintptr_t)63);
}

/* Where the numbers of four designs from `first` on begin, `step` apart; the last one fills up. */
LANES void offsets(int64_t first, int64_t designs, int64_t step, int64_t *lane)
{
    for (int64_t l = 0; l < 4; l++) lane[l] = step * (first + l < designs ? first + l : designs - 1);
}

LANES lanes gathered(const double *from, const int64_t *lane)
{
    return (lanes){from[lane[0]], from[lane[1]], from[lane[2]], from[lane[3]]};
}

LANES lanes root(lanes a)
{
    return (lanes){sqrt(a[0]), sqrt(a[1]), sqrt(a[2]), sqrt(a[3])};
}

LANES lanes larger(lanes a, lanes b)
{
    for (int l = 0; l < 4; l++) a[l] = a[l] > b[l] ? a[l] : b[l];
    return a;
}

LANES lanes absolute(lanes a)
{
    for (int l = 0; l < 4; l++) a[l] = fabs(a[l]);
    return a;
}

LANES void clear(lanes *A, int64_t n)
{
    for (int64_t i = 0; i < n; i++) A[i] = (lanes){0};
}

/* out (m, n) += A (m, k) B (k, n), with rows so long in memory; entry (i, j) of A lies at i `down` + j `along`. */
LANES void add_product(const lanes *A, int64_t down, int64_t along, const lanes *B, int64_t b, lanes *out, int64_t width,
                       int64_t m, int64_t k, int64_t n)
{
    for (int64_t i = 0; i < m; i++) {
        const lanes *row = A + i * down;
        lanes *to = out + i * width;
        int64_t j = 0;
        for (; j + 6 <= n; j += 6) {
            lanes s0 = to[j], s1 = to[j + 1], s2 = to[j + 2], s3 = to[j + 3], s4 = to[j + 4], s5 = to[j + 5];
            for (int64_t l = 0; l < k; l++) {
                const lanes a = row[l * along], *from = B + l * b + j;
                s0 += a * from[0], s1 += a * from[1], s2 += a * from[2];
                s3 += a * from[3], s4 += a * from[4], s5 += a * from[5];
            }
            to[j] = s0, to[j + 1] = s1, to[j + 2] = s2, to[j + 3] = s3, to[j + 4] = s4, to[j + 5] = s5;
        }
        for (; j < n; j++) {
            lanes sum = to[j];
            for (int64_t l = 0; l < k; l++) sum += row[l * along] * B[l * b + j];
            to[j] = sum;
        }
    }
}

/* Cholesky's factor L of a symmetric A (n, n), into its lower half, and one over its diagonal; the lanes in which A is
not definite are told in `good`, and have ones there. */
LANES void factored(lanes *A, int64_t n, int64_t width, lanes *inverse, lanes *good)
{
    for (int64_t j = 0; j < n; j++) {
        lanes *rows = A + j * width;
        lanes pivot = rows[j];
        for (int64_t k = 0; k < j; k++) pivot -= rows[k] * rows[k];
        for (int l = 0; l < 4; l++)
            if (!(pivot[l] > 0 && pivot[l] < HUGE_VAL)) (*good)[l] = 0, pivot[l] = 1;
        rows[j] = root(pivot);
        inverse[j] = 1 / rows[j];
        int64_t i = j + 1;
        for (; i + 3 <= n; i += 3) {
            lanes *a = A + i * width, *b = a + width, *c = b + width, x = a[j], y = b[j], z = c[j];
            for (int64_t k = 0; k < j; k++) x -= a[k] * rows[k], y -= b[k] * rows[k], z -= c[k] * rows[k];
            a[j] = x * inverse[j], b[j] = y * inverse[j], c[j] = z * inverse[j];
        }
        for (; i < n; i++) {
            lanes *a = A + i * width, x = a[j];
            for (int64_t k = 0; k < j; k++) x -= a[k] * rows[k];
            a[j] = x * inverse[j];
        }
    }
}

/* L^-1 in the place of a lower L (n, n), given one over its diagonal. */
LANES void turned_over(lanes *L, int64_t n, const lanes *inverse)
{
    for (int64_t j = 0; j < n; j++) {
        L[j * n + j] = inverse[j];
        for (int64_t i = j + 1; i < n; i++) {
            lanes sum = {0};
            for (int64_t k = j; k < i; k++) sum += L[i * n + k] * L[k * n + j];
            L[i * n + j] = -sum * inverse[i];
        }
    }
}

/* d with which D A D has a diagonal of ones. */
LANES void unit_scale(const lanes *A, int64_t n, int64_t width, lanes *d)
{
    for (int64_t i = 0; i < n; i++) {
        lanes size = absolute(A[i * width + i]);
        for (int l = 0; l < 4; l++) d[i][l] = 1 / sqrt(size[l] > 0 ? size[l] : 1);
    }
}

/* The inverse (n, n) of a symmetric A (n, n), from factors of it with a diagonal of ones. L has n (n + 2) numbers. */
LANES void inverted(const lanes *A, int64_t n, int64_t width, lanes *L, lanes *out, lanes *good)
{
    lanes *d = L + n * n, *inverse = d + n;
    unit_scale(A, n, width, d);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j <= i; j++) L[i * n + j] = A[i * width + j] * d[i] * d[j];
    factored(L, n, n, inverse, good);
    turned_over(L, n, inverse);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j <= i; j++) {
            lanes sum = {0};
            for (int64_t k = i; k < n; k++) sum += L[k * n + i] * L[k * n + j];
            out[i * n + j] = out[j * n + i] = sum * d[i] * d[j];
        }
}

#endif
