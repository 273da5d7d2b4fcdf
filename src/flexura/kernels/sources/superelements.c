/* Superelements in large motion, as motion/superelements.py: energies of fourth order in frames that turn. */
#include "elements.h"

/* Energies d'kd/2 + cddd/6 + qdddd/24 of the deformations d (n), the latter two of the first m. Of each order what is
different stands once, four elements side by side, ordered as combinations of numbers that do not fall: `pair` (m, m)
finds the place of two of them, `triple` (pairs, m) that of a pair and one more, `quadruple` (triples, m) likewise. */
typedef struct {
    int64_t n, m, pairs, triples, quadruples;
    const double *stiffness, *cubic, *quartic;
    const int64_t *pair, *triple, *quadruple;
} polynomial;

/* `count` of the k frames of elements (e) have places; `rest` (6 count - 6), `axes`, `arm` and `mass`, its upper
triangle, stand four elements side by side. */
typedef struct {
    int64_t e, k, count;
    const int64_t *node;
    const double *axes, *arm, *rest, *mass, *series;
    const polynomial *energy;
} superelements;

/* What is worked out of four elements, in memory of the caller. */
typedef struct {
    place *ends;
    logarithm *logs;
    four *d, *n, *rates, *v, *a, *moved, *Mv, *Ma, *force, *triples, *H, *left, *K, *rows;
} work;

/* Numbers of `four` that take_work lays out: 31 count + 138 k + 108 k k + triples at most. */
INLINE work take_work(const superelements *own, double *scratch)
{
    int64_t size = 6 * own->k;
    work w;
    w.ends = (place *)scratch;
    w.logs = (logarithm *)(w.ends + own->count);
    w.d = (four *)(w.logs + own->count);
    w.n = w.d + size, w.rates = w.n + size, w.v = w.rates + size, w.a = w.v + size, w.moved = w.a + size;
    w.Mv = w.moved + size, w.Ma = w.Mv + size, w.force = w.Ma + size, w.rows = w.force + size;
    w.H = w.rows + 12 * size, w.left = w.H + size * size, w.K = w.left + size * size, w.triples = w.K + size * size;
    return w;
}

/* Energy of four elements, its gradient (n), and its Hessian (n, n) where there is room for it. */
INLINE four energy_of(four *gradient, four *H, four *triples, const polynomial *own, int64_t block, const four *d)
{
    int64_t n = own->n, m = own->m, tri = n * (n + 1) / 2;
    const double *k = own->stiffness + 4 * tri * block, *c = own->cubic + 4 * own->triples * block;
    const double *q = own->quartic + 4 * own->quadruples * block;
    four energy = {0};
    for (int64_t i = 0; i < n; i++) gradient[i] = (four){0};
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = i; j < n; j++, k += 4) {
            four value = AT(k, 0);
            gradient[i] += value * d[j];
            if (j > i) gradient[j] += value * d[i];
            if (H) H[n * i + j] = H[n * j + i] = value;
        }
    for (int64_t i = 0; i < n; i++) energy += 0.5 * d[i] * gradient[i];
    if (!own->triples) return energy;
    for (int64_t t = 0; t < own->triples; t++) triples[t] = (four){0};
    if (own->quadruples)
        for (int64_t t = 0; t < own->triples; t++)
            for (int64_t i = 0; i < m; i++) triples[t] += AT(q, 4 * own->quadruple[t * m + i]) * d[i];
    for (int64_t i = 0; i < m; i++) {
        four second = {0}, third = {0};
        for (int64_t j = 0; j < m; j++) {
            four by_c = {0}, by_q = {0};
            const int64_t *at = own->triple + own->pair[i * m + j] * m;
            for (int64_t l = 0; l < m; l++) by_c += AT(c, 4 * at[l]) * d[l], by_q += triples[at[l]] * d[l];
            second += by_c * d[j], third += by_q * d[j];
            if (H) H[n * i + j] += by_c + 0.5 * by_q;
        }
        gradient[i] += 0.5 * second + third / 6.0;
        energy += d[i] * (second / 6.0 + third / 24.0);
    }
    return energy;
}

/* Where the ends of four elements are, the logarithms of their poses, and their deformations (theory eq. G3). */
INLINE void deformed(work *w, const superelements *own, int64_t block, const int64_t *row, const double *x,
                     const double *R, const double *z, int second)
{
    int64_t k = own->k, count = own->count, frame[4];
    const double *rest = own->rest + 4 * (6 * count - 6) * block;
    for (int64_t i = 0; i < k; i++) {
        for (int l = 0; l < 4; l++) frame[l] = own->node[k * row[l] + i];
        if (i < count) place_of(w->ends + i, x, R, frame, own->axes + 36 * block, own->arm + 12 * (count * block + i));
        else
            for (int64_t j = 0; j < 6; j++) w->d[6 * i - 6 + j] = gathered(z, frame, 6, j);
        if (i == 0 || i >= count) continue;
        four apart[9], reach[3];
        logarithm *log = w->logs + i - 1;
        relative(apart, reach, w->ends, w->ends + i);
        take_logarithm(log, apart, reach, own->series, second);
        for (int64_t j = 6 * i - 6; j < 6 * i; j++) w->d[j] = log->e[j - 6 * i + 6] - AT(rest, 4 * j);
    }
}

/* Forces on the frames of what is conjugate to the deformations, n: the product with the transposed rows. */
INLINE void at_frames(work *w, const superelements *own)
{
    int64_t count = own->count;
    memset(w->force, 0, 6 * own->k * sizeof *w->force);
    for (int64_t i = 0; i < count - 1; i++) {
        four h[6];
        log_back_times(h, w->logs + i, -1.0, w->n + 6 * i);
        for (int j = 0; j < 6; j++) h[j] = -h[j];
        add_at_frame(w->force, w->ends, h);
        log_back_times(h, w->logs + i, 1.0, w->n + 6 * i);
        add_at_frame(w->force + 6 * i + 6, w->ends + i + 1, h);
    }
    memcpy(w->force + 6 * count, w->n + 6 * count - 6, 6 * (own->k - count) * sizeof *w->n);
}

/* Adds forces by the rates of the deformations, `damping` s times stiffness. */
INLINE void damp(work *w, const superelements *own, double damping)
{
    int64_t count = own->count, d = 6 * own->k - 6;
    four first[6], other[6], before[6];
    twisted(first, w->ends, w->v);
    for (int64_t i = 0; i < count - 1; i++) {
        twisted(other, w->ends + i + 1, w->v + 6 * i + 6);
        log_times(w->rates + 6 * i, w->logs + i, 1.0, other);
        log_times(before, w->logs + i, -1.0, first);
        for (int j = 0; j < 6; j++) w->rates[6 * i + j] -= before[j];
    }
    memcpy(w->rates + 6 * count - 6, w->v + 6 * count, 6 * (own->k - count) * sizeof *w->v);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++) w->n[i] += damping * w->H[d * i + j] * w->rates[j];
}

/* Forces (e, 6k) on the frames at x, R and z that hold, damp and accelerate the elements, and their strain and kinetic
energies, `energies` (2) (theory eqs. G33-G34). `scratch` as take_work. */
KERNEL int64_t superelements_kinetics(const superelements *own, const double *x, const double *R, const double *z,
                                      const double *velocity, const double *acceleration, double damping,
                                      double *scratch, double *force, double *energies)
{
    int64_t k = own->k, row[4], frame[4], size = 6 * k;
    double first[64] = {1.0};
    work w = take_work(own, scratch);
    energies[0] = energies[1] = 0;
    for (int64_t block = 0; 4 * block < own->e; block++) {
        int64_t count = rows_of(row, block, own->e);
        deformed(&w, own, block, row, x, R, z, 0);
        for (int64_t i = 0; i < k; i++) {
            for (int l = 0; l < 4; l++) frame[l] = own->node[k * row[l] + i];
            for (int64_t j = 0; j < 6; j++) {
                w.v[6 * i + j] = gathered(velocity, frame, 6, j);
                w.a[6 * i + j] = gathered(acceleration, frame, 6, j);
            }
        }
        four strain = energy_of(w.n, damping ? w.H : 0, w.triples, own->energy, block, w.d);
        if (damping) damp(&w, own, damping);
        at_frames(&w, own);
        const double *mass = own->mass + 4 * (size * (size + 1) / 2) * block;
        four kinetic = accelerating(w.force, k, own->count, mass, w.ends[0].axes, w.ends, first, w.v, w.a, w.moved,
                                    w.Mv, w.Ma);
        energies[0] += sum_of(strain, count), energies[1] += sum_of(kinetic, count);
        write_rows(force, block, count, size, w.force);
    }
    return 0;
}

/* Energies (e), forces (e, 6k) and tangents (e, 6k, 6k) in a state of the frames (theory eq. G7). */
KERNEL int64_t superelements_response(const superelements *own, const double *x, const double *R, const double *z,
                                      double *scratch, double *energy, double *force, double *K)
{
    int64_t row[4], size = 6 * own->k;
    work w = take_work(own, scratch);
    for (int64_t block = 0; 4 * block < own->e; block++) {
        int64_t count = rows_of(row, block, own->e);
        deformed(&w, own, block, row, x, R, z, 1);
        four own_energy = energy_of(w.n, w.H, w.triples, own->energy, block, w.d);
        at_frames(&w, own);
        tangent(w.K, own->k, own->count, w.ends, w.logs, w.n, w.H, w.left, w.rows);
        write_rows(energy, block, count, 1, &own_energy);
        write_rows(force, block, count, size, w.force);
        write_rows(K, block, count, size * size, w.K);
    }
    return 0;
}

/* Mass matrices (e, 6k, 6k) by velocities of the frames. */
KERNEL int64_t superelements_masses(const superelements *own, const double *x, const double *R, double *scratch,
                                    double *M)
{
    int64_t k = own->k, row[4], frame[4], size = 6 * k;
    work w = take_work(own, scratch);
    for (int64_t block = 0; 4 * block < own->e; block++) {
        int64_t count = rows_of(row, block, own->e);
        for (int64_t i = 0; i < own->count; i++) {
            for (int l = 0; l < 4; l++) frame[l] = own->node[k * row[l] + i];
            place_of(w.ends + i, x, R, frame, own->axes + 36 * block, own->arm + 12 * (own->count * block + i));
            memcpy(w.ends[i].axes, w.ends[0].axes, sizeof w.ends[0].axes);
        }
        carried(w.K, k, own->count, own->mass + 4 * (size * (size + 1) / 2) * block, w.ends);
        write_rows(M, block, count, size * size, w.K);
    }
    return 0;
}
