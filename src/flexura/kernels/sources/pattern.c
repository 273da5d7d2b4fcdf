/* Sums of small matrices as a sparse one, column by column: what touches a column is known by `columns`, the rows that are
stored there by `pattern`, and their sums by `pattern_sum`.

Small matrices come in groups: `count` matrices of `width` rows, which lie one behind the other as numbers A (count, width,
width), and as DOFs (count, width), -1 where a row and a column are dropped; the DOFs of all groups lie one behind the other. A
column of a small matrix is known by its group and its place among those of the group. */
#include "flexura.h"

#include <stdlib.h>

typedef struct { int64_t count, width; } group;
typedef struct { int64_t group, place; } column;

static int ascending(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

/* Rows in order: most columns have few. */
static void sort(int32_t *rows, int64_t count)
{
    if (count > 48) {
        qsort(rows, (size_t)count, sizeof *rows, ascending);
        return;
    }
    for (int64_t i = 1; i < count; i++) {
        int32_t row = rows[i];
        int64_t j = i;
        for (; j > 0 && rows[j - 1] > row; j--) rows[j] = rows[j - 1];
        rows[j] = row;
    }
}

/* Where the columns of small matrices that touch each column are, first (n + 1), and which, in order, touching. */
KERNEL int64_t columns(int64_t n, int64_t groups, const group *of, const int64_t *dofs, int64_t *first, column *touching)
{
    memset(first, 0, (size_t)(n + 1) * sizeof *first);
    const int64_t *at = dofs;
    for (int64_t g = 0; g < groups; g++)
        for (int64_t k = 0; k < of[g].count * of[g].width; k++, at++)
            if (*at >= 0) first[*at]++;
    for (int64_t c = 0, sum = 0; c <= n; c++) {
        int64_t count = first[c];
        first[c] = sum;
        sum += count;
    }
    at = dofs;
    for (int64_t g = 0; g < groups; g++)
        for (int64_t k = 0; k < of[g].count * of[g].width; k++, at++)
            if (*at >= 0) touching[first[*at]++] = (column){g, k};
    memmove(first + 1, first, (size_t)n * sizeof *first);
    first[0] = 0;
    return 0;
}

/* What is stored of such a sum, start (n + 1) and rows, in order; `before` (groups) are the DOFs before each group. `seen` (n)
is scratch. It returns the number of what is stored. */
KERNEL int64_t pattern(int64_t n, const group *of, const int64_t *before, const int64_t *dofs, const int64_t *first,
                       const column *touching, int32_t *start, int32_t *rows, int64_t *seen)
{
    int64_t stored = 0;
    memset(seen, -1, (size_t)n * sizeof *seen);
    for (int64_t c = 0; c < n; c++) {
        start[c] = (int32_t)stored;
        for (int64_t t = first[c]; t < first[c + 1]; t++) {
            int64_t width = of[touching[t].group].width, place = touching[t].place;
            const int64_t *own = dofs + before[touching[t].group] + place - place % width;
            for (int64_t i = 0; i < width; i++)
                if (own[i] >= 0 && seen[own[i]] != c) seen[own[i]] = c, rows[stored++] = (int32_t)own[i];
        }
        sort(rows + start[c], stored - start[c]);
    }
    start[n] = (int32_t)stored;
    return stored;
}

/* The numbers of the sum, out, one for each that is stored, of matrices A by group. A column is taken across where that is
asked for, and a symmetric sum is the mean of both. `sum` and `next` (n) are scratch. */
KERNEL int64_t pattern_sum(int64_t n, const group *of, const int64_t *before, const int64_t *dofs, const int64_t *first,
                           const column *touching, const int32_t *start, const int32_t *rows, const double *const *A,
                           int64_t symmetric, double *out, double *sum, int64_t *next)
{
    memset(sum, 0, (size_t)n * sizeof *sum);
    for (int64_t c = 0; c < n; c++) {
        for (int64_t t = first[c]; t < first[c + 1]; t++) {
            int64_t width = of[touching[t].group].width, place = touching[t].place, across = place % width;
            const int64_t *own = dofs + before[touching[t].group] + place - across;
            /* of a symmetric sum a row, which lies together, is as good as a column */
            const double *a = A[touching[t].group] + (symmetric ? place * width : (place - across) * width + across);
            for (int64_t i = 0, step = symmetric ? 1 : width; i < width; i++, a += step)
                if (own[i] >= 0) sum[own[i]] += *a;
        }
        for (int64_t at = start[c]; at < start[c + 1]; at++) {
            int64_t r = rows[at];
            out[at] = sum[r];
            sum[r] = 0.0;
            if (!symmetric) continue;
            if (r < c) {
                int64_t other = next[r]++;
                out[at] = out[other] = (out[at] + out[other]) / 2;
            } else if (r == c)
                next[c] = at + 1;
        }
    }
    return 0;
}
