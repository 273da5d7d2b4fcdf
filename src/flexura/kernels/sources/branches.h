/* Branches of an arrow, four designs at a time. */
#ifndef BRANCHES_H
#define BRANCHES_H

#include "lanes.h"

/* Of kinds of branches: K, M and R (n, n) of four designs, with the errors of their diagonals (n), and r maps T (i, c)
to the ends; n = inside + i. */
typedef struct {
    int64_t r, n, inside, c;
    lanes *A, *slack, *T;
} branch;

/* `matrices` of K, M and R and their slack, of kind `k` of q, from A (3, designs, q, n, n), slack (3, designs, q, n)
and T (q, r, i, c), which is `step` on for the next design. */
LANES void read_branch(branch *b, const double *A, const double *slack, const double *T, int64_t step, int64_t matrices,
                       int64_t first, int64_t designs, int64_t q, int64_t k)
{
    const int64_t n = b->n, nn = n * n, maps = b->r * (n - b->inside) * b->c;
    int64_t at[4], row[4], lane[4];
    offsets(first, designs, q * nn, at);
    offsets(first, designs, q * n, row);
    offsets(first, designs, step, lane);
    for (int64_t s = 0; s < matrices; s++) {
        const double *from = A + (s * designs * q + k) * nn, *rows = slack + (s * designs * q + k) * n;
        for (int64_t i = 0; i < nn; i++) b->A[s * nn + i] = gathered(from + i, at);
        for (int64_t i = 0; slack && i < n; i++) b->slack[s * n + i] = gathered(rows + i, row);
    }
    for (int64_t i = 0; i < maps; i++) b->T[i] = gathered(T + k * maps + i, lane);
}

/* Add T' S T (c, c) of r maps T (i, c), and (|T|' sqrt a)^2 (c). */
LANES void placed(const branch *b, const lanes *S, const lanes *a, lanes *half, lanes *C, lanes *sizes)
{
    const int64_t ends = b->n - b->inside, c = b->c;
    for (int64_t r = 0; r < b->r; r++) {
        const lanes *T = b->T + r * ends * c;
        clear(half, ends * c);
        add_product(S, ends, 1, T, c, half, c, ends, ends, c);
        add_product(T, 1, c, half, c, C, c, c, ends, c);
        for (int64_t j = 0; sizes && j < c; j++) {
            lanes sum = {0};
            for (int64_t i = 0; i < ends; i++) sum += absolute(T[i * c + j]) * root(a[i]);
            sizes[j] += sum * sum;
        }
    }
}

#endif
