/* Where small matrices go in a sparse sum of them, by columns with their rows in order: each column is counted, then marked. */
#include "flexura.h"

#include <stdlib.h>

static int ascending(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* Rows in order: most columns have few. */
static void sort(int64_t *rows, int64_t count)
{
    if (count > 48) {
        qsort(rows, (size_t)count, sizeof *rows, ascending);
        return;
    }
    for (int64_t i = 1; i < count; i++) {
        int64_t row = rows[i], j = i;
        for (; j > 0 && rows[j - 1] > row; j--) rows[j] = rows[j - 1];
        rows[j] = row;
    }
}

/* Of entries with keys (m), column n + row, or -1 where they are dropped: where each is stored, target (m), the number of
what is stored for those dropped; and what is stored, start (n + 1) and rows. `order` (m), `seen` and `place` (n) are scratch.
It returns the number of what is stored. */
KERNEL int64_t pattern(int64_t n, int64_t m, const int64_t *keys, int64_t *target, int64_t *start, int64_t *rows,
                       int64_t *order, int64_t *seen, int64_t *place)
{
    memset(start, 0, (size_t)(n + 1) * sizeof *start);
    for (int64_t e = 0; e < m; e++)
        if (keys[e] >= 0) start[keys[e] / n + 1]++;
    for (int64_t c = 0; c < n; c++) start[c + 1] += start[c], seen[c] = -1, place[c] = start[c];
    for (int64_t e = 0; e < m; e++)
        if (keys[e] >= 0) order[place[keys[e] / n]++] = e;
    int64_t stored = 0, first = 0;
    for (int64_t c = 0; c < n; c++) {
        int64_t begin = stored, last = start[c + 1];
        for (int64_t at = first; at < last; at++) {
            int64_t row = keys[order[at]] - c * n;
            if (seen[row] != c) seen[row] = c, rows[stored++] = row;
        }
        sort(rows + begin, stored - begin);
        for (int64_t at = begin; at < stored; at++) place[rows[at]] = at;
        for (int64_t at = first; at < last; at++) target[order[at]] = place[keys[order[at]] - c * n];
        first = last;
        start[c] = begin;
    }
    start[n] = stored;
    for (int64_t e = 0; e < m; e++)
        if (keys[e] < 0) target[e] = stored;
    return stored;
}

/* The place of the entry across each one of a symmetric pattern. `next` (n) is scratch. */
KERNEL int64_t pattern_across(int64_t n, const int64_t *start, const int64_t *rows, int64_t *across, int64_t *next)
{
    memcpy(next, start, (size_t)n * sizeof *next);
    for (int64_t c = 0; c < n; c++)
        for (int64_t at = start[c]; at < start[c + 1]; at++) across[at] = next[rows[at]]++;
    return 0;
}
