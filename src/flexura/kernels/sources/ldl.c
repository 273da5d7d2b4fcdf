/* A = L D L' of sparse symmetric matrices row by row, with diagonal pivots in a given order: L is one on the diagonal.

Of A the upper triangle is given by columns: rows[i] of column k stand from start[k] to start[k + 1], the diagonal one last.
Sources: Liu (1990), SIAM J. Matrix Anal. Appl. 11 (elimination trees); Davis (2005), ACM Trans. Math. Softw. 31. */
#include "ldl.h"

/* The elimination tree, parent (n), -1 at roots, and how many entries each column of L has below its diagonal, count (n).
`seen` (n) is scratch. */
KERNEL int64_t ldl_tree(int64_t n, const int64_t *start, const int64_t *rows, int64_t *parent, int64_t *count,
                        int64_t *seen)
{
    for (int64_t k = 0; k < n; k++) {
        parent[k] = -1, count[k] = 0, seen[k] = k;
        for (int64_t at = start[k]; at < start[k + 1]; at++)
            for (int64_t i = rows[at]; seen[i] != k; i = parent[i]) {
                if (parent[i] < 0) parent[i] = k;
                count[i]++, seen[i] = k;
            }
    }
    return 0;
}

/* The columns that row k of L has entries in, every one after those below it in the tree: in stack from the place that is
returned up to n. */
static inline int64_t reach(int64_t n, int64_t k, const int64_t *start, const int64_t *rows, const int64_t *parent,
                            int64_t *seen, int64_t *stack)
{
    int64_t top = n;
    seen[k] = k;
    for (int64_t at = start[k]; at < start[k + 1]; at++) {
        int64_t length = 0;
        for (int64_t i = rows[at]; seen[i] != k; i = parent[i]) stack[length++] = i, seen[i] = k;
        while (length > 0) stack[--top] = stack[--length];
    }
    return top;
}

/* The upper triangle of D A D, `upper`, in the order of the factors, of which entry t is the number take[t] of A and that
of across[t] on the other side; d (n) is the diagonal of D. It returns whether these differ by so much nowhere. */
KERNEL int64_t ldl_upper(int64_t n, const int64_t *order, const int64_t *start, const int64_t *rows, const int64_t *take,
                         const int64_t *across, const double *A, const double *d, double most, double *upper)
{
    double apart = 0.0;
    for (int64_t k = 0; k < n; k++)
        for (int64_t at = start[k]; at < start[k + 1]; at++) {
            double row = d[order[rows[at]]], column = d[order[k]];
            upper[at] = A[take[at]] * row * column;
            apart = fmax(apart, fabs(upper[at] - A[across[at]] * row * column));
        }
    return apart <= most;
}

/* L by columns, from first[j] to first[j + 1], and D (n). `filled`, `seen`, `stack` and `y` (n) are scratch. It returns n, or
the row whose pivot is zero or no number. */
KERNEL int64_t ldl_factor(int64_t n, const int64_t *start, const int64_t *rows, const double *values,
                          const int64_t *parent, const int64_t *first, int64_t *below, double *L, double *D,
                          int64_t *filled, int64_t *seen, int64_t *stack, double *y)
{
    for (int64_t k = 0; k < n; k++) filled[k] = first[k], seen[k] = -1, y[k] = 0.0;
    for (int64_t k = 0; k < n; k++) {
        int64_t top = reach(n, k, start, rows, parent, seen, stack);
        for (int64_t at = start[k]; at < start[k + 1]; at++) y[rows[at]] += values[at];
        double pivot = y[k];
        y[k] = 0.0;
        for (; top < n; top++) {
            int64_t j = stack[top];
            double yj = y[j], entry = yj / D[j];
            y[j] = 0.0;
            for (int64_t at = first[j]; at < filled[j]; at++) y[below[at]] -= L[at] * yj;
            pivot -= entry * yj;
            below[filled[j]] = k;
            L[filled[j]++] = entry;
        }
        if (!(fabs(pivot) > 0.0 && fabs(pivot) <= 1e300)) return k;
        D[k] = pivot;
    }
    return n;
}

/* X = A^-1 B (n, m). */
KERNEL int64_t ldl_solve(int64_t n, int64_t m, const int64_t *order, const int64_t *first, const int64_t *below,
                         const double *L, const double *D, const double *B, double *X, double *y)
{
    ldl_solution(n, m, order, first, below, L, D, B, X, y);
    return 0;
}

/* Row sums (n) of |L| |D| |L'|, in the order of A; `y` (n) is scratch. */
KERNEL int64_t ldl_sizes(int64_t n, const int64_t *order, const int64_t *first, const int64_t *below, const double *L,
                         const double *D, double *sizes, double *y)
{
    for (int64_t k = 0; k < n; k++) {
        y[k] = 1.0;
        for (int64_t at = first[k]; at < first[k + 1]; at++) y[k] += fabs(L[at]);
        y[k] *= fabs(D[k]);
        sizes[order[k]] = 0.0;
    }
    for (int64_t k = 0; k < n; k++) {
        sizes[order[k]] += y[k];
        for (int64_t at = first[k]; at < first[k + 1]; at++) sizes[order[below[at]]] += fabs(L[at]) * y[k];
    }
    return 0;
}
