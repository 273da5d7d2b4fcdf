/* Beams and springs between turning frames, as PoseElements of motion/elements.py and Strain of motion/strain.py. */
#include "elements.h"
#include "members.h"

/* `axes`, `arm` and `mass`, its upper triangle, stand four elements side by side, `rest` (e, 6) does not. */
typedef struct {
    int64_t e;
    const int64_t *node;
    const double *axes, *arm, *rest, *mass, *series;
    const strain_of *strain;
} pose_elements;

/* What is known of four elements in a state. */
typedef struct {
    place ends[2];
    logarithm log;
    four q[MOTIONS], n[6], rates[6], warped[WARPING];
} known;

/* Memory of the caller: `blocks` of four elements; where elements warp together `shared`, 72 + q q numbers of four a
block, and `member`, the square of the most rates of a member and as many rows of all that its frames move. */
typedef struct {
    known *blocks;
    four *shared;
    double *member;
} work;

INLINE int64_t blocks_of(const pose_elements *own)
{
    return (own->e + 3) / 4;
}

INLINE int64_t shared_size(const strain_of *own)
{
    return 72 + own->q * own->q;
}

INLINE work take_work(const pose_elements *own, double *scratch)
{
    work w;
    w.blocks = (known *)scratch;
    w.shared = (four *)(w.blocks + blocks_of(own));
    w.member = (double *)(w.shared + (own->strain->w ? blocks_of(own) * shared_size(own->strain) : 0));
    return w;
}

INLINE void frames_of(int64_t *frame, const pose_elements *own, const int64_t *row, int end)
{
    for (int l = 0; l < 4; l++) frame[l] = own->node[2 * row[l] + end];
}

/* Where the ends of four elements are, the logarithm of their pose, and d, its change, with nothing moved inside. */
INLINE void deformed(known *now, const pose_elements *own, int64_t block, const double *x, const double *R, int second)
{
    int64_t row[4], frame[4];
    four apart[9], reach[3];
    rows_of(row, block, own->e);
    for (int end = 0; end < 2; end++) {
        frames_of(frame, own, row, end);
        place_of(now->ends + end, x, R, frame, own->axes + 72 * block + 36 * end, own->arm + 24 * block + 12 * end);
    }
    relative(apart, reach, now->ends, now->ends + 1);
    take_logarithm(&now->log, apart, reach, own->series, second);
    for (int i = 0; i < 6; i++) now->q[i] = now->log.e[i] - gathered(own->rest, row, 6, i);
    for (int64_t i = 6; i < own->strain->q; i++) now->q[i] = (four){0};
}

/* What four elements lack of rest inside, by their own motions and rates of warping: equations (4 + w, 5 + w). */
INLINE void equations_inside(four *both, const known *now, const strain_of *own, int64_t block)
{
    strained state;
    int64_t inside = own->q - 6, columns = inside + 1;
    four H[(MOTIONS - 6) * (MOTIONS - 6)], gradient[MOTIONS - 6];
    take_strains(&state, own, block, now->q);
    gradient_of(gradient, &state, own, 6, own->q);
    hessian_of(H, &state, own, block, 6, own->q, 0);
    for (int64_t i = 0; i < inside; i++) {
        memcpy(both + columns * i, H + inside * i, inside * sizeof *H);
        both[columns * i + inside] = gradient[i];
    }
    eliminate(both, inside, columns, 0, inside - own->w);
}

/* Steps of Newton's method for the motions inside four elements that warp by themselves. */
INLINE void settle(known *now, const strain_of *own, int64_t block)
{
    int64_t inside = own->q - 6, columns = inside + 1;
    four both[(MOTIONS - 6) * (MOTIONS - 5)];
    for (int step = 0; inside && step < STEPS; step++) {
        four largest_step = {0};
        equations_inside(both, now, own, block);
        for (int64_t i = 0; i < inside; i++) {
            four moved = both[columns * i + inside];
            now->q[6 + i] -= moved;
            for (int l = 0; l < 4; l++) largest_step[l] = fmax(largest_step[l], fabs(moved[l]));
        }
        if (largest(largest_step) < SETTLED) break;
    }
}

/* A step of Newton's method inside all elements where those of members warp together; returns the largest. */
INLINE double step_together(const work *w, const strain_of *own)
{
    int64_t inside = own->q - 6, alone = inside - own->w, columns = inside + 1, size = shared_size(own);
    int64_t blocks = (own->e + 3) / 4, known_size = sizeof(known) / sizeof(four);
    double largest_step = 0, *A = w->member;
    for (int64_t b = 0; b < blocks; b++) {
        equations_inside(w->shared + size * b, w->blocks + b, own, b);
        memset(w->blocks[b].warped, 0, sizeof w->blocks[b].warped);
    }
    for (int64_t m = 0; m < own->members; m++) {
        int64_t r = factorise_member(A, own, m, w->shared, size, columns * alone + alone, columns);
        double *missing = A + r * r;
        memset(missing, 0, r * sizeof *missing);
        for (int64_t i = 0; i < own->count[m]; i++)
            for (int64_t a = 0; a < own->w; a++)
                missing[rate_of(own, i, a)] +=
                    *entry(w->shared, size, own->first[m] + i, columns * (alone + a) + inside);
        solve_member(A, missing, own, r, 1);
        for (int64_t i = 0; i < own->count[m]; i++)
            for (int64_t a = 0; a < own->w; a++)
                *entry(w->blocks[0].warped, known_size, own->first[m] + i, a) = missing[rate_of(own, i, a)];
    }
    for (int64_t b = 0; b < blocks; b++) {
        known *now = w->blocks + b;
        int64_t row[4], count = rows_of(row, b, own->e);
        for (int64_t i = 0; i < inside; i++) {
            const four *equation = w->shared + size * b + columns * i;
            four moved = i < alone ? equation[inside] : now->warped[i - alone];
            for (int64_t a = 0; i < alone && a < own->w; a++) moved -= equation[alone + a] * now->warped[a];
            now->q[6 + i] -= moved;
            for (int64_t l = 0; l < count; l++) largest_step = fmax(largest_step, fabs(moved[l]));
        }
    }
    return largest_step;
}

/* All elements in a state, motions inside at rest. */
INLINE work at_rest(const pose_elements *own, const double *x, const double *R, double *scratch, int second)
{
    work w = take_work(own, scratch);
    for (int64_t b = 0; b < blocks_of(own); b++) {
        deformed(w.blocks + b, own, b, x, R, second);
        if (!own->strain->w) settle(w.blocks + b, own->strain, b);
    }
    for (int step = 0; own->strain->w && step < STEPS; step++)
        if (step_together(&w, own->strain) < SETTLED) break;
    return w;
}

/* The Hessian (q, q) of four elements with motions of their own taken out; those by d into k (6, 6). */
INLINE void stiffness_of(four *k, four *H, const strained *state, const strain_of *own, int64_t block, int is_material)
{
    int64_t q = own->q;
    hessian_of(H, state, own, block, 0, q, is_material);
    eliminate(H, q, q, 6, q - 6 - own->w);
    for (int i = 0; i < 6; i++) memcpy(k + 6 * i, H + q * i, 6 * sizeof *k);
}

/* What the damping of elements by warping adds to the forces n, `damping` s times stiffness. */
INLINE void damp_together(const work *w, const strain_of *own, double damping)
{
    int64_t q = own->q, size = shared_size(own), known_size = sizeof(known) / sizeof(four), start = q - own->w;
    double *A = w->member;
    for (int64_t m = 0; m < own->members; m++) {
        int64_t r = factorise_member(A, own, m, w->shared, size, q * start + start, q);
        double *moved = A + r * r;
        memset(moved, 0, r * sizeof *moved);
        for (int64_t i = 0; i < own->count[m]; i++)
            for (int64_t a = 0; a < own->w; a++)
                for (int64_t c = 0; c < 6; c++)
                    moved[rate_of(own, i, a)] += *entry(w->shared, size, own->first[m] + i, q * (start + a) + c)
                                                 * *entry(w->blocks[0].rates, known_size, own->first[m] + i, c);
        solve_member(A, moved, own, r, 1);
        for (int64_t i = 0; i < own->count[m]; i++)
            for (int64_t a = 0; a < own->w; a++)
                for (int64_t c = 0; c < 6; c++)
                    *entry(w->blocks[0].n, known_size, own->first[m] + i, c) -=
                        damping * *entry(w->shared, size, own->first[m] + i, q * (start + a) + c)
                        * moved[rate_of(own, i, a)];
    }
}

/* Adds forces by the rates of deformations, `damping` s times stiffness, but for those of warping together. */
INLINE void damp(known *now, four *H, const strained *state, const strain_of *own, int64_t block, const four *velocity,
                 double damping)
{
    four k[36], first[6], second[6], before[6];
    stiffness_of(k, H, state, own, block, 0);
    twisted(first, now->ends, velocity);
    twisted(second, now->ends + 1, velocity + 6);
    log_times(before, &now->log, -1.0, first);
    log_times(now->rates, &now->log, 1.0, second);
    for (int i = 0; i < 6; i++) now->rates[i] -= before[i];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) now->n[i] += damping * k[6 * i + j] * now->rates[j];
}

INLINE void add_held(four *force, known *now)
{
    four h[6];
    log_back_times(h, &now->log, -1.0, now->n);
    for (int j = 0; j < 6; j++) h[j] = -h[j];
    add_at_frame(force, now->ends, h);
    log_back_times(h, &now->log, 1.0, now->n);
    add_at_frame(force + 6, now->ends + 1, h);
}

/* The axes halfway between those of the ends. */
INLINE void middle(four *axes, const known *now)
{
    four half[3], R[9];
    for (int i = 0; i < 3; i++) half[i] = 0.5 * now->log.e[3 + i];
    rotation(R, half);
    product(axes, now->ends[0].axes, R);
}

INLINE void gather_motion(four *out, const pose_elements *own, int64_t block, const double *motion)
{
    int64_t row[4], frame[4];
    rows_of(row, block, own->e);
    for (int end = 0; end < 2; end++) {
        frames_of(frame, own, row, end);
        for (int j = 0; j < 6; j++) out[6 * end + j] = gathered(motion, frame, 6, j);
    }
}

/* Forces (e, 12) on the frames at x and R that hold, damp and accelerate the elements, and their strain and kinetic
energies, `energies` (2) (theory eqs. G33-G34). */
KERNEL int64_t pose_elements_kinetics(const pose_elements *own, const double *x, const double *R,
                                      const double *velocity, const double *acceleration, double damping,
                                      double *scratch, double *force, double *energies)
{
    static const double halves[2] = {0.5, 0.5};
    const strain_of *strain = own->strain;
    int64_t row[4];
    four v[12], a[12], moved[12], Mv[12], Ma[12], H[MOTIONS * MOTIONS], axes[9];
    strained state;
    work w = at_rest(own, x, R, scratch, 0);
    energies[0] = energies[1] = 0;
    for (int64_t b = 0; b < blocks_of(own); b++) {
        known *now = w.blocks + b;
        take_strains(&state, strain, b, now->q);
        gradient_of(now->n, &state, strain, 0, 6);
        energies[0] += sum_of(state.energy, rows_of(row, b, own->e));
        if (!damping) continue;
        gather_motion(v, own, b, velocity);
        damp(now, strain->w ? w.shared + shared_size(strain) * b : H, &state, strain, b, v, damping);
    }
    if (damping && strain->w) damp_together(&w, strain, damping);
    for (int64_t b = 0; b < blocks_of(own); b++) {
        known *now = w.blocks + b;
        int64_t count = rows_of(row, b, own->e);
        four sum[12] = {{0}};
        add_held(sum, now);
        middle(axes, now);
        gather_motion(v, own, b, velocity);
        gather_motion(a, own, b, acceleration);
        four kinetic = accelerating(sum, 2, 2, own->mass + 4 * 78 * b, axes, now->ends, halves, v, a, moved, Mv, Ma);
        energies[1] += sum_of(kinetic, count);
        write_rows(force, b, count, 12, sum);
    }
    return 0;
}

/* What warping together adds to tangents, by all frames of one member after another, (6n + 6)^2 each. */
INLINE void coupled_tangents(double *out, const work *w, const strain_of *own)
{
    int64_t q = own->q, size = shared_size(own), start = q - own->w;
    double *A = w->member;
    for (int64_t m = 0; m < own->members; m++) {
        int64_t n = own->count[m], columns = 6 * n + 6;
        int64_t r = factorise_member(A, own, m, w->shared, size, q * start + start, q);
        double *resisted = A + r * r, *follow = resisted + r * columns;
        memset(resisted, 0, r * columns * sizeof *resisted);
        for (int64_t i = 0; i < n; i++)
            for (int64_t a = 0; a < own->w; a++)
                for (int64_t c = 0; c < 6; c++) {
                    int64_t element = own->first[m] + i;
                    double *to = resisted + columns * rate_of(own, i, a) + 6 * i;
                    double by = *entry(w->shared, size, element, q * (start + a) + c);
                    for (int64_t f = 0; f < 12; f++)
                        to[f] += by * *entry(w->shared, size, element, q * q + 36 * (f / 6) + 6 * c + f % 6);
                }
        memcpy(follow, resisted, r * columns * sizeof *follow);
        solve_member(A, follow, own, r, columns);
        memset(out, 0, columns * columns * sizeof *out);
        for (int64_t p = 0; p < r; p++)
            for (int64_t i = 0; i < columns; i++) {
                double by = resisted[columns * p + i];
                for (int64_t j = 0; by && j < columns; j++) out[columns * i + j] -= by * follow[columns * p + j];
            }
        out += columns * columns;
    }
}

/* Energies (e), forces (e, 12) and tangents (e, 12, 12) in a state of the frames, and what warping adds for members,
`coupled` (theory eq. G7); tangents as if there were no forces if `is_material` (theory eq. G16). */
KERNEL int64_t pose_elements_response(const pose_elements *own, const double *x, const double *R, int64_t is_material,
                                      double *scratch, double *energy, double *force, double *K, double *coupled)
{
    const strain_of *strain = own->strain;
    int64_t row[4];
    four H[MOTIONS * MOTIONS], k[36], left[72], tangents[144], rows[144];
    strained state;
    work w = at_rest(own, x, R, scratch, 1);
    for (int64_t b = 0; b < blocks_of(own); b++) {
        known *now = w.blocks + b;
        int64_t count = rows_of(row, b, own->e);
        four sum[12] = {{0}}, *shared = w.shared + shared_size(strain) * b;
        take_strains(&state, strain, b, now->q);
        gradient_of(now->n, &state, strain, 0, 6);
        if (is_material) memset(now->n, 0, sizeof now->n);
        stiffness_of(k, strain->w ? shared : H, &state, strain, b, (int)is_material);
        tangent(tangents, 2, 2, now->ends, &now->log, now->n, k, left, rows);
        if (strain->w) memcpy(shared + strain->q * strain->q, rows, 72 * sizeof *rows);
        add_held(sum, now);
        write_rows(energy, b, count, 1, &state.energy);
        write_rows(force, b, count, 12, sum);
        write_rows(K, b, count, 144, tangents);
    }
    if (strain->w) coupled_tangents(coupled, &w, strain);
    return 0;
}

/* Mass matrices (e, 12, 12) by velocities of the frames. */
KERNEL int64_t pose_elements_masses(const pose_elements *own, const double *x, const double *R, double *scratch,
                                    double *M)
{
    int64_t row[4];
    four out[144], axes[9];
    known *now = take_work(own, scratch).blocks;
    for (int64_t b = 0; b < blocks_of(own); b++) {
        deformed(now, own, b, x, R, 0);
        middle(axes, now);
        for (int end = 0; end < 2; end++) memcpy(now->ends[end].axes, axes, sizeof axes);
        carried(out, 2, 2, own->mass + 4 * 78 * b, now->ends);
        write_rows(M, b, rows_of(row, b, own->e), 144, out);
    }
    return 0;
}
