/* Matrices of chains and discrete elements at their places, L' A L summed, and what that may be off, theory eq. N10. */
#include "lanes.h"

/* A map L (n, n) by its entries that are not zero: column after column, from `first[j]` on, each with its row. */
typedef struct {
    int64_t n, *first, *row;
    lanes *value;
} map;

LANES void read_map(map *L, const double *from, const int64_t *lane)
{
    int64_t count = 0;
    for (int64_t j = 0; j < L->n; j++) {
        L->first[j] = count;
        for (int64_t i = 0; i < L->n; i++) {
            lanes value = gathered(from + i * L->n + j, lane);
            if (value[0] == 0 && value[1] == 0 && value[2] == 0 && value[3] == 0) continue;
            L->value[count] = value;
            L->row[count++] = i;
        }
    }
    L->first[L->n] = count;
}

/* Six columns of A from j on, fewer at its end, in the rows that column i of L names: their sums, `step` apart. */
LANES void combined(const map *L, int64_t i, const lanes *A, int64_t j, lanes *out, int64_t step)
{
    const int64_t n = L->n, last = L->first[i + 1];
    if (j + 6 <= n) {
        lanes a = {0}, b = {0}, c = {0}, d = {0}, e = {0}, f = {0};
        for (int64_t k = L->first[i]; k < last; k++) {
            const lanes factor = L->value[k], *row = A + L->row[k] * n + j;
            a += factor * row[0], b += factor * row[1], c += factor * row[2];
            d += factor * row[3], e += factor * row[4], f += factor * row[5];
        }
        out[0] = a, out[step] = b, out[2 * step] = c, out[3 * step] = d, out[4 * step] = e, out[5 * step] = f;
    } else
        for (; j < n; j++, out += step) {
            lanes a = {0};
            for (int64_t k = L->first[i]; k < last; k++) a += L->value[k] * A[L->row[k] * n + j];
            *out = a;
        }
}

/* L' A L (n, n) of a symmetric A, over it; T (n, n) is scratch. */
LANES void place(const map *L, lanes *A, lanes *T)
{
    const int64_t n = L->n;
    for (int64_t i = 0; i < n; i++) /* A L */
        for (int64_t j = 0; j < n; j += 6) combined(L, i, A, j, T + j * n + i, n);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j <= i; j += 6) combined(L, i, T, j, A + i * n + j, 1);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++) A[j * n + i] = A[i * n + j];
}

/* Where a map of n coordinates lies in scratch: numbers, and whole numbers. */
LANES map map_at(int64_t n, int64_t number, lanes *values, int64_t *rows)
{
    int64_t *first = rows + number * (n + 1) * (n + 1);
    return (map){n, first, first + n + 1, values + number * n * n};
}

/* Where some of c matrices (n, n) go: `which` (p) stands at each of p places, and the maps L (p, n, n) there, with |L|
`size`, `step` on for the next design. */
typedef struct {
    const int64_t *which;
    const double *maps, *size;
    int64_t p, n, step;
} places;

/* Maps to places for four designs from `first` on. */
LANES void read_maps(const places *own, int64_t first, int64_t designs, int with_size, lanes *values, int64_t *rows)
{
    const int64_t n = own->n, nn = n * n;
    int64_t at[4];
    offsets(first, designs, own->step, at);
    for (int64_t i = 0; i < own->p; i++) {
        map L = map_at(n, i, values, rows), S = map_at(n, own->p + i, values, rows);
        read_map(&L, own->maps + i * nn, at);
        if (with_size) read_map(&S, own->size + i * nn, at);
    }
}

/* Add L' A L of matrices A (designs, c, n, n) at their places for four designs to `sum` at the targets, and what that may
be off to `spread` unless `rounding` is zero; `own` has (2 n n + n) lanes. */
LANES void add_part(const double *A, int64_t c, const places *given, int64_t first, int64_t designs, const int64_t *entry,
                    const int64_t *row, double rounding, lanes *values, int64_t *rows, lanes *own, lanes *sum, lanes *spread)
{
    const int64_t n = given->n, nn = n * n;
    lanes *T = own + nn, *roots = T + nn;
    int64_t at[4];
    offsets(first, designs, c * nn, at);
    for (int64_t i = 0; i < given->p; i++) {
        const map L = map_at(n, i, values, rows), S = map_at(n, given->p + i, values, rows);
        const double *from = A + given->which[i] * nn;
        for (int64_t j = 0; j < nn; j++) own[j] = gathered(from + j, at);
        for (int64_t j = 0; j < n; j++) roots[j] = root(absolute(own[j * n + j]));
        place(&L, own, T);
        for (int64_t j = 0; j < nn; j++) sum[entry[i * nn + j]] += own[j];
        for (int64_t j = 0; rounding > 0 && j < n; j++) {
            lanes s = {0};
            for (int64_t b = S.first[j]; b < S.first[j + 1]; b++) s += S.value[b] * roots[S.row[b]];
            spread[row[i * n + j]] += rounding * n * s * s;
        }
    }
}

/* The sums (r, designs, entries) of L' A L of parts A (r, designs, c, n, n) each, by their `kinds` c, at their targets, and
the bounds on their errors `spreads` (r, designs, rows) unless `rounding` is zero. `sizes` are the number of parts, r,
designs, entries, rows and the largest n; scratch is of (2 n n + n + entries + rows) lanes and 2 p n n of each part, and
2 p (n + 1)^2 whole ones of each. */
KERNEL int64_t placed_sums(const double *const *A, const int64_t *kinds, const places *const *parts, const int64_t *entry,
                           const int64_t *row, const int64_t *sizes, double rounding, double *scratch, int64_t *rows,
                           double *sums, double *spreads)
{
    const int64_t r = sizes[1], designs = sizes[2], entries = sizes[3], held = sizes[4], n = sizes[5];
    lanes *own = aligned(scratch), *sum = own + 2 * n * n + n, *spread = sum + entries, *values = spread + held;
    for (int64_t first = 0; first < designs; first += 4)
        for (int64_t k = 0; k < r; k++) {
            int64_t value = 0, whole = 0, at_entry = 0, at_row = 0;
            clear(sum, entries), clear(spread, held);
            for (int64_t i = 0; i < sizes[0]; i++) {
                const places *given = parts[i];
                const int64_t m = given->n, p = given->p;
                if (k == 0 && (first == 0 || given->step))
                    read_maps(given, first, designs, rounding > 0, values + value, rows + whole);
                add_part(A[i] + k * designs * kinds[i] * m * m, kinds[i], given, first, designs, entry + at_entry,
                         row + at_row, rounding, values + value, rows + whole, own, sum, spread);
                value += 2 * p * m * m, whole += 2 * p * (m + 1) * (m + 1), at_entry += p * m * m, at_row += p * m;
            }
            for (int64_t l = 0; l < 4 && first + l < designs; l++) {
                double *to = sums + (k * designs + first + l) * entries;
                for (int64_t j = 0; j < entries; j++) to[j] = sum[j][l];
                to = spreads + (k * designs + first + l) * held;
                for (int64_t j = 0; rounding > 0 && j < held; j++) to[j] = spread[j][l];
            }
        }
    return 0;
}
