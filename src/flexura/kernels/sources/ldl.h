/* Solutions with factors L D L', for kernels that need some of their own. */
#ifndef LDL_H
#define LDL_H

#include "flexura.h"

/* As ldl_solution, where the compiler may know m. */
INLINE void ldl_columns(int64_t n, int64_t m, const int64_t *order, const int64_t *first, const int64_t *below,
                        const double *L, const double *D, const double *B, double *X, double *y)
{
    for (int64_t k = 0; k < n; k++)
        for (int64_t c = 0; c < m; c++) y[k * m + c] = B[order[k] * m + c];
    for (int64_t k = 0; k < n; k++)
        for (int64_t at = first[k]; at < first[k + 1]; at++)
            for (int64_t c = 0; c < m; c++) y[below[at] * m + c] -= L[at] * y[k * m + c];
    for (int64_t k = n - 1; k >= 0; k--) {
        double *own = y + k * m, inverse = 1.0 / D[k];
        for (int64_t c = 0; c < m; c++) own[c] *= inverse;
        for (int64_t at = first[k]; at < first[k + 1]; at++)
            for (int64_t c = 0; c < m; c++) own[c] -= L[at] * y[below[at] * m + c];
        for (int64_t c = 0; c < m; c++) X[order[k] * m + c] = own[c];
    }
}

/* X = A^-1 B (n, m), where row k of the factors is row order[k] of both; `y` (n, m) is scratch. */
INLINE void ldl_solution(int64_t n, int64_t m, const int64_t *order, const int64_t *first, const int64_t *below,
                         const double *L, const double *D, const double *B, double *X, double *y)
{
    if (m == 1) ldl_columns(n, 1, order, first, below, L, D, B, X, y);
    else ldl_columns(n, m, order, first, below, L, D, B, X, y);
}

#endif
