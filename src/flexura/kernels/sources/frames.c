/* Frames that turn, as Frames of motion/elements.py and displacement of motion/path.py, and the bodies that they carry. */
#include "elements.h"

/* Frames `at` (n), or the first n where that is none, after displacements `step` (n, 6), in place: those that are placed move
and turn, the others have amplitudes. */
KERNEL int64_t frames_moved(int64_t n, const int64_t *at, const uint8_t *placed, const double *step, double *x, double *R,
                            double *z)
{
    int64_t turning[4], from[4], count = 0;
    for (int64_t k = 0; k < n; k++) {
        int64_t i = at ? at[k] : k;
        const double *own = step + 6 * k;
        for (int j = 0; !placed[i] && j < 6; j++) z[6 * i + j] += own[j];
        for (int j = 0; placed[i] && j < 3; j++) x[3 * i + j] += own[j];
        if (placed[i] && (own[3] != 0 || own[4] != 0 || own[5] != 0)) from[count] = k, turning[count++] = i;
        if (!count || (count < 4 && k < n - 1)) continue;
        four w[3], turn[9], before[9], after[9];
        for (int64_t l = count; l < 4; l++) turning[l] = turning[0], from[l] = from[0];
        for (int j = 0; j < 3; j++) w[j] = gathered(step, from, 6, 3 + j);
        for (int j = 0; j < 9; j++) before[j] = gathered(R, turning, 9, j);
        rotation(turn, w);
        product(after, turn, before);
        for (int64_t l = 0; l < count; l++)
            for (int j = 0; j < 9; j++) R[9 * turning[l] + j] = after[j][l];
        count = 0;
    }
    return 0;
}

/* Displacements (n, 6) from one state of frames to another. */
INLINE void between(four *out, const int64_t *row, const double *const *start, const double *const *end)
{
    four before[9], after[9], turn[9];
    for (int j = 0; j < 9; j++) before[j] = gathered(start[1], row, 9, j), after[j] = gathered(end[1], row, 9, j);
    product_of_back(turn, after, before);
    rotation_vector(out + 3, turn);
    for (int j = 0; j < 3; j++) out[j] = gathered(end[0], row, 3, j) - gathered(start[0], row, 3, j);
    for (int j = 0; j < 6; j++) out[j] += gathered(end[2], row, 6, j) - gathered(start[2], row, 6, j);
}

KERNEL int64_t frames_between(int64_t n, const double *x, const double *R, const double *z, const double *x_end,
                              const double *R_end, const double *z_end, double *out)
{
    const double *start[3] = {x, R, z}, *end[3] = {x_end, R_end, z_end};
    for (int64_t block = 0; 4 * block < n; block++) {
        int64_t row[4], count = rows_of(row, block, n);
        four moved[6];
        between(moved, row, start, end);
        write_rows(out, block, count, 6, moved);
    }
    return 0;
}

/* Forces that accelerate what frames `at` (e) carry, inertia (6, 6) in their own axes, its upper triangle four by four,
added to those on the frames, `force` (n, 6); the kinetic energy into `energy` (theory eq. G33). */
KERNEL int64_t bodies_kinetics(int64_t e, const int64_t *at, const double *inertia, const double *R,
                               const double *velocity, const double *acceleration, double *force, double *energy)
{
    static const double one[1] = {1.0};
    *energy = 0;
    for (int64_t block = 0; 4 * block < e; block++) {
        int64_t row[4], frame[4], count = rows_of(row, block, e);
        four v[6], a[6], moved[6], Mv[6], Ma[6], axes[9], own[6] = {{0}};
        place ends[1] = {{{{0}}, {{0}}, {{0}}}};
        for (int l = 0; l < 4; l++) frame[l] = at[row[l]];
        for (int j = 0; j < 9; j++) axes[j] = gathered(R, frame, 9, j);
        for (int j = 0; j < 6; j++) v[j] = gathered(velocity, frame, 6, j), a[j] = gathered(acceleration, frame, 6, j);
        four kinetic = accelerating(own, 1, 1, inertia + 4 * 21 * block, axes, ends, one, v, a, moved, Mv, Ma);
        *energy += sum_of(kinetic, count);
        for (int64_t l = 0; l < count; l++)
            for (int j = 0; j < 6; j++) force[6 * frame[l] + j] += own[j][l];
    }
    return 0;
}
