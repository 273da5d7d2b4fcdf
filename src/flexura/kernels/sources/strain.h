/* Strains of elements that are quadratic in motions q, four elements at a time, as motion/strain.py and bowing.py. */
#ifndef STRAIN_H
#define STRAIN_H

#include "se3.h"

enum { WARPING = 6, MOTIONS = 10 + WARPING, STRAINS = 13 + WARPING, POINTS = 3, MODES = 24, STEPS = 10 };

#define SETTLED 1e-12 /* rad, largest last step of motions inside */
#define HELD 1e-9
#define SLENDER 720.0

/* `strains` by q = 6 + inside + w motions, the last w of which elements of a member share. Of the stiffness and of
curvatures what is not zero in all elements stands four elements side by side: of the stiffness at places (i, j), j >= i,
of curvatures at (strain, i, j), j >= i, and of the rows that make curvature and twist of strains at the three points at
(2 point + which, strain). `plate` is zero where nothing `bows`. Of `members`, `first` and `count` are elements. */
typedef struct {
    int64_t e, strains, q, w, stiff, curved, bows, rows, members;
    const int64_t *stiff_at, *curved_at, *rows_at, *first, *count;
    const double *stiffness, *curvature, *row, *plate, *nu, *searle, *free, *shares, *roots;
} strain_of;

/* Strains of a block of elements in a state q, what is conjugate to them, and the slope (strains, q). */
typedef struct {
    four strain[STRAINS], stress[STRAINS], slope[STRAINS * MOTIONS], energy;
    four by_bent[POINTS][3]; /* stiffness by curvature twice, by it and twist, by twist twice */
} strained;

INLINE four each_exp(four a)
{
    return (four){exp(a[0]), exp(a[1]), exp(a[2]), exp(a[3])};
}

INLINE four at_least(four a, double least)
{
    for (int l = 0; l < 4; l++) a[l] = a[l] > least ? a[l] : least;
    return a;
}

/* The shares of a free bow that a strip loses by its curvature, y, in bending and in twist, with first and second
derivatives by y (theory eqs. G39-G40). */
INLINE void lost(four *bending, four *twisting, const strain_of *own, four y, four free)
{
    four bow = {0}, first = {0}, second = {0};
    for (int k = 0; k < MODES; k++) {
        double share = own->shares[k], root = own->roots[k];
        four part = share / (1.0 + y / root), by = part / (share * root);
        bow += part, first -= part * by, second += 2.0 * part * by * by;
    }
    four left = free / (1.0 + free * (1.0 / bow - 1.0)), ratio = left / bow, by_y = ratio * ratio * first;
    four by_yy = ratio * ratio * (second - 2.0 * first * first / bow) + 2.0 * by_y * by_y / at_least(left, HELD);
    four quicker = root(1.0 + y / SLENDER), held = at_least(1.0 - free, HELD);
    for (int l = 0; l < 4; l++) held[l] = log(held[l]);
    four flat = each_exp(quicker * held), slope = held / (2.0 * SLENDER * quicker);
    bending[0] = free - left, bending[1] = -by_y, bending[2] = -by_yy;
    twisting[0] = 1.0 - flat - left, twisting[1] = -flat * slope - by_y;
    twisting[2] = -flat * slope * (slope - 1.0 / (2.0 * SLENDER * quicker * quicker)) - by_yy;
}

/* Adds what keeps elements flat across (theory eq. G40). */
INLINE void bowed(strained *now, const strain_of *own, int64_t block)
{
    static const double weights[POINTS] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    four both[2 * POINTS] = {{0}}, force[2 * POINTS], plate = AT(own->plate, 4 * block), nu = AT(own->nu, 4 * block);
    four searle = AT(own->searle, 4 * block);
    const double *row = own->row + 4 * own->rows * block;
    for (int64_t i = 0; i < own->rows; i++)
        both[own->rows_at[2 * i]] += AT(row, 4 * i) * now->strain[own->rows_at[2 * i + 1]];
    for (int p = 0; p < POINTS; p++) {
        four bent = both[2 * p], twist = both[2 * p + 1], weight = plate * weights[p], bending[3], twisting[3];
        lost(bending, twisting, own, searle * bent * bent, AT(own->free, 4 * (POINTS * block + p)));
        four change = 2.0 * searle * bent, square[2] = {0.5 * nu * nu * bent * bent, nu * twist * twist};
        four first[2] = {bending[1] * change, twisting[1] * change};
        four second[2] = {bending[2] * change * change + 2.0 * searle * bending[1],
                          twisting[2] * change * change + 2.0 * searle * twisting[1]};
        four by_first = square[0] * first[0] + square[1] * first[1];
        now->energy += weight * (square[0] * bending[0] + square[1] * twisting[0]);
        force[2 * p] = weight * (nu * nu * bent * bending[0] + by_first);
        force[2 * p + 1] = weight * 2.0 * nu * twist * twisting[0];
        now->by_bent[p][0] = weight * (nu * nu * (bending[0] + 2.0 * bent * first[0]) + square[0] * second[0]
                                       + square[1] * second[1]);
        now->by_bent[p][1] = weight * 2.0 * nu * twist * first[1];
        now->by_bent[p][2] = weight * 2.0 * nu * twisting[0];
    }
    for (int64_t i = 0; i < own->rows; i++)
        now->stress[own->rows_at[2 * i + 1]] += AT(row, 4 * i) * force[own->rows_at[2 * i]];
}

/* Strains e = q + q'Hq/2 with their slope, and what is conjugate to them. */
SHARED void take_strains(strained *now, const strain_of *own, int64_t block, const four *q)
{
    const double *k = own->stiffness + 4 * own->stiff * block, *h = own->curvature + 4 * own->curved * block;
    int64_t n = own->q;
    memset(now->slope, 0, own->strains * n * sizeof *now->slope);
    for (int64_t i = 0; i < own->strains; i++) {
        now->strain[i] = i < n ? q[i] : (four){0}, now->stress[i] = (four){0};
        if (i < n) now->slope[n * i + i] += 1.0;
    }
    for (int64_t c = 0; c < own->curved; c++) {
        const int64_t *at = own->curved_at + 3 * c;
        four value = AT(h, 4 * c), by = value * q[at[2]], *slope = now->slope + n * at[0];
        slope[at[1]] += by;
        if (at[1] != at[2]) slope[at[2]] += value * q[at[1]];
        now->strain[at[0]] += (at[1] == at[2] ? 0.5 : 1.0) * by * q[at[1]];
    }
    for (int64_t c = 0; c < own->stiff; c++) {
        int64_t i = own->stiff_at[2 * c], j = own->stiff_at[2 * c + 1];
        four value = AT(k, 4 * c);
        now->stress[i] += value * now->strain[j];
        if (i != j) now->stress[j] += value * now->strain[i];
    }
    now->energy = (four){0};
    for (int64_t i = 0; i < own->strains; i++) now->energy += 0.5 * now->strain[i] * now->stress[i];
    if (own->bows) bowed(now, own, block);
}

/* Gradient (to - from) of the energy by motions. */
INLINE void gradient_of(four *gradient, const strained *now, const strain_of *own, int64_t from, int64_t to)
{
    for (int64_t j = from; j < to; j++) gradient[j - from] = (four){0};
    for (int64_t i = 0; i < own->strains; i++)
        for (int64_t j = from; j < to; j++) gradient[j - from] += now->slope[own->q * i + j] * now->stress[i];
}

/* H += slope' stiffness slope of what keeps strips flat, by motions from one to another. */
INLINE void add_bowed(four *H, const strained *now, const strain_of *own, int64_t block, int64_t from, int64_t to)
{
    four both[2 * POINTS][MOTIONS];
    const double *row = own->row + 4 * own->rows * block;
    int64_t n = to - from;
    memset(both, 0, sizeof both);
    for (int64_t i = 0; i < own->rows; i++) {
        four value = AT(row, 4 * i), *out = both[own->rows_at[2 * i]];
        const four *slope = now->slope + own->q * own->rows_at[2 * i + 1] + from;
        for (int64_t a = 0; a < n; a++) out[a] += value * slope[a];
    }
    for (int p = 0; p < POINTS; p++) {
        const four *bent = both[2 * p], *twist = both[2 * p + 1], *k = now->by_bent[p];
        for (int64_t a = 0; a < n; a++) {
            four by_bent = k[0] * bent[a] + k[1] * twist[a], by_twist = k[1] * bent[a] + k[2] * twist[a];
            for (int64_t b = a; b < n; b++) H[n * a + b] += by_bent * bent[b] + by_twist * twist[b];
        }
    }
}

/* The symmetric Hessian (to - from)^2 of the energy by motions, without that of forces if `is_material`. */
SHARED void hessian_of(four *H, const strained *now, const strain_of *own, int64_t block, int64_t from, int64_t to,
                       int is_material)
{
    four pushed[STRAINS * MOTIONS];
    const double *k = own->stiffness + 4 * own->stiff * block, *h = own->curvature + 4 * own->curved * block;
    int64_t n = to - from, size = own->strains;
    memset(pushed, 0, size * n * sizeof *pushed);
    for (int64_t c = 0; c < own->stiff; c++) {
        int64_t i = own->stiff_at[2 * c], j = own->stiff_at[2 * c + 1];
        const four *one = now->slope + own->q * i + from, *other = now->slope + own->q * j + from;
        four value = AT(k, 4 * c);
        for (int64_t a = 0; a < n; a++) pushed[n * i + a] += value * other[a];
        for (int64_t a = 0; i != j && a < n; a++) pushed[n * j + a] += value * one[a];
    }
    for (int64_t a = 0; a < n; a++)
        for (int64_t b = a; b < n; b++) {
            four sum = {0};
            for (int64_t i = 0; i < size; i++) sum += now->slope[own->q * i + from + a] * pushed[n * i + b];
            H[n * a + b] = sum;
        }
    if (own->bows) add_bowed(H, now, own, block, from, to);
    for (int64_t c = 0; !is_material && c < own->curved; c++) {
        const int64_t *at = own->curved_at + 3 * c;
        if (at[1] >= from && at[2] < to) H[n * (at[1] - from) + at[2] - from] += AT(h, 4 * c) * now->stress[at[0]];
    }
    for (int64_t a = 0; a < n; a++)
        for (int64_t b = 0; b < a; b++) H[n * a + b] = H[n * b + a];
}

/* Takes `count` motions from `first` on out of n equations with so many columns, by Gauss and Jordan without pivots: the
energy is least there. Equation p of these is left as one for motion p by what is not taken out. */
INLINE void eliminate(four *H, int64_t n, int64_t columns, int64_t first, int64_t count)
{
    for (int64_t p = first; p < first + count; p++) {
        four inverse = 1.0 / H[columns * p + p];
        for (int64_t j = 0; j < columns; j++) H[columns * p + j] *= inverse;
        for (int64_t i = 0; i < n; i++) {
            if (i == p) continue;
            four by = H[columns * i + p];
            for (int64_t j = 0; j < columns; j++) H[columns * i + j] -= by * H[columns * p + j];
        }
    }
}

#endif
