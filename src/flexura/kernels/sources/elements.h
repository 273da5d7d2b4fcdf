/* Elements between turning frames, four at a time, as motion/elements.py: where their ends are, what their masses do. */
#ifndef ELEMENTS_H
#define ELEMENTS_H

#include "se3.h"

/* One number each of four rows of an array of `size` a row. */
INLINE four gathered(const double *array, const int64_t *row, int64_t size, int64_t at)
{
    return (four){array[size * row[0] + at], array[size * row[1] + at], array[size * row[2] + at],
                  array[size * row[3] + at]};
}

/* Elements `row` of a block, the last one again where there are fewer than four; returns how many there are. */
INLINE int64_t rows_of(int64_t *row, int64_t block, int64_t e)
{
    for (int64_t l = 0; l < 4; l++) row[l] = 4 * block + l < e ? 4 * block + l : e - 1;
    return e - 4 * block < 4 ? e - 4 * block : 4;
}

INLINE void write_rows(double *array, int64_t block, int64_t count, int64_t size, const four *values)
{
    for (int64_t l = 0; l < count; l++) {
        double *out = array + size * (4 * block + l);
        for (int64_t i = 0; i < size; i++) out[i] = values[i][l];
    }
}

INLINE double sum_of(four values, int64_t count)
{
    double sum = 0;
    for (int64_t l = 0; l < count; l++) sum += values[l];
    return sum;
}

/* Axes as columns, the arm from the frame, and where the end is, global. */
typedef struct {
    four axes[9], arm[3], x[3];
} place;

/* The ends at four frames of x and R, with `axes` and `arm`, four by four, as their frames carry them. */
INLINE void place_of(place *end, const double *x, const double *R, const int64_t *frame, const double *axes,
                     const double *arm)
{
    four now[9], own[9], reach[3];
    for (int i = 0; i < 9; i++) now[i] = gathered(R, frame, 9, i), own[i] = AT(axes, 4 * i);
    for (int i = 0; i < 3; i++) reach[i] = AT(arm, 4 * i);
    product(end->axes, now, own);
    turned(end->arm, now, reach);
    for (int i = 0; i < 3; i++) end->x[i] = gathered(x, frame, 3, i) + end->arm[i];
}

/* The pose of one end seen from another. */
INLINE void relative(four *R, four *x, const place *first, const place *other)
{
    four apart[3];
    for (int i = 0; i < 3; i++) apart[i] = other->x[i] - first->x[i];
    product_back(R, first->axes, other->axes);
    turned_back(x, first->axes, apart);
}

/* Twists (6) of an end, in its axes, of a velocity (6) of its frame. */
INLINE void twisted(four *h, const place *end, const four *velocity)
{
    four v[3] = {velocity[0], velocity[1], velocity[2]};
    add_cross(v, 1.0, velocity + 3, end->arm);
    turned_back(h, end->axes, v);
    turned_back(h + 3, end->axes, velocity + 3);
}

/* Forces (6) added to a frame by those conjugate to twists of the end: the transpose. */
INLINE void add_at_frame(four *force, const place *end, const four *n)
{
    four f[3], m[3];
    turned(f, end->axes, n);
    turned(m, end->axes, n + 3);
    add_cross(m, 1.0, end->arm, f);
    for (int i = 0; i < 3; i++) force[i] += f[i], force[3 + i] += m[i];
}

/* N times the twists of an end by displacements of its frame, [[C, -C skew(arm)], [0, C]], C = axes'. */
INLINE void times_twists(six out, six N, const place *end)
{
    for (int b = 0; b < 4; b += 2) {
        product_of_back(out[b], N[b], end->axes);
        product_of_back(out[b + 1], N[b + 1], end->axes);
        add_skew_right(out[b + 1], -1.0, out[b], end->arm);
    }
}

/* The transposed twists of an end times N. */
INLINE void twists_back(six out, six N, const place *end)
{
    for (int b = 0; b < 2; b++) {
        product(out[b], end->axes, N[b]);
        product(out[b + 2], end->axes, N[b + 2]);
        add_skew_left(out[b + 2], 1.0, end->arm, out[b]);
    }
}

/* Blocks as rows of 6, `step` apart. */
INLINE void as_rows(four *out, int64_t step, six N)
{
    for (int b = 0; b < 4; b++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) out[step * (3 * (b / 2) + i) + 3 * (b % 2) + j] = N[b][3 * i + j];
}

/* Derivatives (6, 6) of a logarithm by displacements of one of its frames, factor after or before (theory eq. G4). */
INLINE void log_rows(four *B, const logarithm *log, double side, const place *end)
{
    six N = {{{0}}}, out;
    log_blocks(N[0], N[1], log, side);
    memcpy(N[3], N[0], sizeof N[0]);
    times_twists(out, N, end);
    for (int b = 0; b < 4; b++)
        for (int i = 0; i < 9; i++) out[b][i] *= side;
    as_rows(B, 6, out);
}

/* K (6k, 6k) += left (6k, 6k - 6) times the `rows` of the logarithms and of amplitudes. */
INLINE void by_frames(four *K, int64_t k, int64_t count, const four *left, const four *rows)
{
    int64_t d = 6 * k - 6, size = 6 * k;
    for (int64_t row = 0; row < size; row++, K += size, left += d) {
        for (int64_t i = 0; i < count - 1; i++)
            for (int64_t c = 0; c < 6; c++) {
                four by = left[6 * i + c];
                const four *first = rows + 72 * i + 6 * c, *own = first + 36;
                for (int64_t a = 0; a < 6; a++) K[a] += by * first[a], K[6 * i + 6 + a] += by * own[a];
            }
        for (int64_t c = 6 * count - 6; c < d; c++) K[6 + c] += left[c];
    }
}

/* Derivatives K (6k, 6k) of the forces on k frames by their displacements, but that they turn along with them: of ends seen from the first by `count` - 1 logarithms, forces n and stiffness H (6k - 6) by these and
by amplitudes (theory eq. G7). `left` has 36 k k numbers, `rows` 72 k. */
INLINE void tangent(four *K, int64_t k, int64_t count, const place *ends, const logarithm *logs, const four *n,
                    const four *H, four *left, four *rows)
{
    int64_t d = 6 * k - 6, size = 6 * k, inner = 6 * count - 6;
    memset(left, 0, size * d * sizeof *left);
    memset(K, 0, size * size * sizeof *K);
    for (int64_t i = 0; i < count - 1; i++) {
        four *first = rows + 72 * i, *own = first + 36, *at = left + (6 * i + 6) * d;
        log_rows(first, logs + i, -1.0, ends);
        log_rows(own, logs + i, 1.0, ends + i + 1);
        for (int64_t r = 0; r < 6; r++)
            for (int64_t a = 0; a < 6; a++) {
                four by_first = first[6 * r + a], by_own = own[6 * r + a];
                const four *row = H + (6 * i + r) * d;
                for (int64_t c = 0; c < d; c++) left[a * d + c] += by_first * row[c], at[a * d + c] += by_own * row[c];
            }
    }
    memcpy(left + 6 * count * d, H + inner * d, (size - 6 * count) * d * sizeof *left);
    for (int64_t i = 0; i < count - 1; i++) {
        six before, after, turned_first, turned_own;
        four flat[36];
        log_second(before, after, logs + i, n + 6 * i);
        twists_back(turned_first, before, ends);
        twists_back(turned_own, after, ends + i + 1);
        as_rows(flat, 6, turned_first);
        for (int64_t a = 0; a < 6; a++)
            for (int64_t c = 0; c < 6; c++) left[a * d + 6 * i + c] -= flat[6 * a + c];
        as_rows(flat, 6, turned_own);
        for (int64_t a = 0; a < 6; a++)
            for (int64_t c = 0; c < 6; c++) left[(6 * i + 6 + a) * d + 6 * i + c] += flat[6 * a + c];
    }
    by_frames(K, k, count, left, rows);
}

/* Products M v and M a (n) of a symmetric matrix, of which the upper triangles of four stand row by row. */
INLINE void symmetric_products(four *Mv, four *Ma, const double *M, int64_t n, const four *v, const four *a)
{
    for (int64_t i = 0; i < n; i++) Mv[i] = Ma[i] = (four){0};
    for (int64_t i = 0; i < n; i++) {
        four m = AT(M, 0), v_i = v[i], a_i = a[i], sum_v = Mv[i] + m * v_i, sum_a = Ma[i] + m * a_i;
        M += 4;
        for (int64_t j = i + 1; j < n; j++, M += 4) {
            m = AT(M, 0);
            sum_v += m * v[j], sum_a += m * a[j];
            Mv[j] += m * v_i, Ma[j] += m * a_i;
        }
        Mv[i] = sum_v, Ma[i] = sum_a;
    }
}

/* Velocities or accelerations v, a (6) of a frame made those of its end in `axes`, seen from what turns by `mean`; the
velocity stays in `moved`, global. */
INLINE void into_axes(four *v, four *a, four *moved, const four *axes, const four *arm, const four *mean)
{
    four swing[3] = {0}, own[6];
    add_cross(swing, 1.0, v + 3, arm);
    add_cross(a, 1.0, v + 3, swing);
    add_cross(a, 1.0, a + 3, arm);
    for (int i = 0; i < 3; i++) v[i] += swing[i];
    add_cross(a, -1.0, mean, v);
    add_cross(a + 3, -1.0, mean, v + 3);
    memcpy(moved, v, 6 * sizeof *v);
    for (int part = 0; part < 6; part += 3) {
        turned_back(v + part, axes, moved + part);
        turned_back(own + part, axes, a + part);
    }
    memcpy(a, own, sizeof own);
}

/* Forces (6k) that accelerate masses (6k, 6k) of four elements, as symmetric_products takes them, added to `force`;
returns their kinetic energy (theory eq. G33). Velocities v and accelerations a (6k) of the frames are changed; `moved`,
Mv and Ma have 6k numbers each. */
INLINE four accelerating(four *force, int64_t k, int64_t p, const double *M, const four *axes, const place *ends,
                         const double *turning, four *v, four *a, four *moved, four *Mv, four *Ma)
{
    four mean[3] = {0}, lost[3] = {0}, energy = {0}, back[6];
    for (int64_t i = 0; i < p; i++)
        for (int j = 0; j < 3; j++) mean[j] += turning[i] * v[6 * i + 3 + j];
    for (int64_t i = 0; i < p; i++) into_axes(v + 6 * i, a + 6 * i, moved + 6 * i, axes, ends[i].arm, mean);
    symmetric_products(Mv, Ma, M, 6 * k, v, a);
    for (int64_t i = 0; i < 6 * k; i++) energy += 0.5 * v[i] * Mv[i];
    for (int64_t i = 0; i < 6 * p; i += 3) {
        turned(back, axes, Mv + i);
        memcpy(Mv + i, back, 3 * sizeof *back);
        add_cross(lost, 1.0, back, moved + i);
    }
    for (int64_t i = 0; i < p; i++) {
        four *own = force + 6 * i, *momentum = Mv + 6 * i, *at = moved + 6 * i;
        turned(back, axes, Ma + 6 * i);
        turned(back + 3, axes, Ma + 6 * i + 3);
        add_cross(back, 1.0, mean, momentum);
        add_cross(back + 3, 1.0, mean, momentum + 3);
        add_cross(back + 3, 1.0, momentum + 3, at + 3);
        add_cross(back + 3, 1.0, ends[i].arm, back);
        for (int j = 0; j < 3; j++) own[j] += back[j], own[3 + j] += back[3 + j] - turning[i] * lost[j];
    }
    for (int64_t i = 6 * p; i < 6 * k; i++) force[i] += Ma[i];
    return energy;
}

/* Masses (6k, 6k) by velocities of the frames, of which the first p carry ends that the masses see in their axes. */
INLINE void carried(four *out, int64_t k, int64_t p, const double *M, const place *ends)
{
    int64_t size = 6 * k;
    for (int64_t i = 0; i < size; i++)
        for (int64_t j = i; j < size; j++, M += 4) out[size * i + j] = out[size * j + i] = AT(M, 0);
    for (int64_t i = 0; i < k; i++)
        for (int64_t j = 0; j < k; j++) {
            four *own = out + 6 * (size * i + j);
            six block, seen;
            for (int b = 0; b < 36; b++) block[b / 9][b % 9] = own[size * (3 * (b / 18) + b % 9 / 3) + 3 * (b / 9 % 2) + b % 3];
            if (j < p) times_twists(seen, block, ends + j), memcpy(block, seen, sizeof seen);
            if (i < p) twists_back(seen, block, ends + i), memcpy(block, seen, sizeof seen);
            as_rows(own, size, block);
        }
}

#endif
