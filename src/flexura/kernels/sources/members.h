/* Rates of warping that elements of a member share: banded equations of one member after another. */
#ifndef MEMBERS_H
#define MEMBERS_H

#include "strain.h"

/* Number of the rate at its end of element i of a member: both ends in one case and then in the next. */
INLINE int64_t rate_of(const strain_of *own, int64_t i, int64_t warping)
{
    return (i + warping % 2) * (own->w / 2) + warping / 2;
}

/* An entry of four elements side by side, `size` numbers of four a block. */
INLINE double *entry(four *values, int64_t size, int64_t element, int64_t at)
{
    return (double *)(values + size * (element / 4) + at) + element % 4;
}

/* A (r, r), of the r rates of warping of a member, summed from what its elements have at `at` and on, rows `step` apart,
and factorised, L D L' below and on the diagonal. Returns r. */
INLINE int64_t factorise_member(double *A, const strain_of *own, int64_t member, four *values, int64_t size, int64_t at,
                                int64_t step)
{
    int64_t n = own->count[member], r = (n + 1) * (own->w / 2), band = own->w;
    memset(A, 0, r * r * sizeof *A);
    for (int64_t i = 0; i < n; i++)
        for (int64_t a = 0; a < own->w; a++)
            for (int64_t b = 0; b < own->w; b++)
                A[r * rate_of(own, i, a) + rate_of(own, i, b)] +=
                    *entry(values, size, own->first[member] + i, at + step * a + b);
    for (int64_t p = 0; p < r; p++) {
        int64_t end = p + band < r ? p + band : r;
        for (int64_t i = p + 1; i < end; i++) {
            double by = A[r * i + p] / A[r * p + p];
            for (int64_t j = p + 1; j <= i; j++) A[r * i + j] -= by * A[r * j + p];
        }
        for (int64_t i = p + 1; i < end; i++) A[r * i + p] /= A[r * p + p];
    }
    return r;
}

/* Solves for B (r, m) in place. */
INLINE void solve_member(const double *A, double *B, const strain_of *own, int64_t r, int64_t m)
{
    int64_t band = own->w;
    for (int64_t p = 0; p < r; p++)
        for (int64_t i = p + 1; i < r && i < p + band; i++)
            for (int64_t j = 0; j < m; j++) B[m * i + j] -= A[r * i + p] * B[m * p + j];
    for (int64_t p = r; p-- > 0;) {
        for (int64_t j = 0; j < m; j++) B[m * p + j] /= A[r * p + p];
        for (int64_t i = p + 1; i < r && i < p + band; i++)
            for (int64_t j = 0; j < m; j++) B[m * p + j] -= A[r * i + p] * B[m * i + j];
    }
}

#endif
