/* Moments of serial chains of elements, theory eqs. N3-N5 and N9: four designs at a time, one in each lane.

Everything is in twists at the pole of the chain. Of an element with ends a, b in walking order the maps to its own axes
are X = [R C; 0 R], so that its mass is X' M X, and its flexibility Y C Y' with Y = [R' C'; 0 R'] of its end j. */
#include "lanes.h"

enum { LARGEST_BASIS = 144 };

/* Coefficients (elements, k) of designs `step` apart, and their basis: `entries` values, and for each its coefficient
and place. */
typedef struct {
    const double *coefficients, *values;
    const int64_t *places;
    int64_t step, k, entries;
} table;

/* A chain of e elements in n = 12 + kept coordinates: flexibilities F (e, 36) and their running sums P (e + 1, 36),
motions V (e + 1, 6, n - 6) but for those of the first end, loads and then wrenches W (e + 1, 6, n), those of kept
motions B (e, 6, kept) and twists by them S (e, 6, kept); matrices M, R (n, n), stiffness k (36). */
typedef struct {
    int64_t e, n, kept;
    lanes *F, *P, *V, *W, *B, *S, *M, *R, *k, *small;
    lanes free, size;
} chain;

/* Geometry of an element: R (9), and C (9) of its ends a, b. */
typedef struct {
    lanes R[9], a[9], b[9];
} arms;

LANES void expanded(const table *t, int64_t number, const int64_t *design, lanes *A, int64_t size)
{
    lanes c[LARGEST_BASIS];
    int64_t lane[4];
    for (int l = 0; l < 4; l++) lane[l] = design[l] * t->step + number * t->k;
    for (int64_t i = 0; i < t->k; i++) c[i] = gathered(t->coefficients + i, lane);
    clear(A, size);
    for (int64_t i = 0; i < t->entries; i++) A[t->places[2 * i + 1]] += t->values[i] * c[t->places[2 * i]];
}

LANES void read_arms(const double *X, const int64_t *lane, int64_t turned, arms *g)
{
    const double *a = X + 72 * turned, *b = X + 72 * (1 - turned) + 6;
    for (int64_t i = 0; i < 3; i++)
        for (int64_t j = 0; j < 3; j++) {
            g->R[3 * i + j] = gathered(a + 12 * i + j, lane);
            g->a[3 * i + j] = gathered(a + 12 * i + j + 3, lane);
            g->b[3 * i + j] = gathered(b + 12 * i + j + 3, lane);
        }
}

/* X_a' M X_b (6, 6) of M in rows of 12. */
LANES void moved_mass(const lanes *M, const arms *g, const lanes *Ca, const lanes *Cb, lanes *out)
{
    lanes t[36] = {0};
    for (int half = 0; half < 2; half++) {
        const lanes *rows = M + 36 * half;
        add_product(rows, 12, 1, g->R, 3, t + 18 * half, 6, 3, 3, 3);
        add_product(rows, 12, 1, Cb, 3, t + 18 * half + 3, 6, 3, 3, 3);
        add_product(rows + 3, 12, 1, g->R, 3, t + 18 * half + 3, 6, 3, 3, 3);
    }
    clear(out, 36);
    add_product(g->R, 1, 3, t, 6, out, 6, 3, 3, 6);
    add_product(Ca, 1, 3, t, 6, out + 18, 6, 3, 3, 6);
    add_product(g->R, 1, 3, t + 18, 6, out + 18, 6, 3, 3, 6);
}

/* Y C Y' (6, 6). */
LANES void moved_flexibility(const lanes *C, const arms *g, const lanes *Cj, lanes *F)
{
    lanes t[36] = {0};
    add_product(g->R, 1, 3, C, 6, t, 6, 3, 3, 6);
    add_product(Cj, 1, 3, C + 18, 6, t, 6, 3, 3, 6);
    add_product(g->R, 1, 3, C + 18, 6, t + 18, 6, 3, 3, 6);
    clear(F, 36);
    for (int half = 0; half < 2; half++) {
        add_product(t + 18 * half, 6, 1, g->R, 3, F + 18 * half, 6, 3, 3, 3);
        add_product(t + 18 * half + 3, 6, 1, Cj, 3, F + 18 * half, 6, 3, 3, 3);
        add_product(t + 18 * half + 3, 6, 1, g->R, 3, F + 18 * half + 3, 6, 3, 3, 3);
    }
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < i; j++) F[6 * i + j] = F[6 * j + i] = (F[6 * i + j] + F[6 * j + i]) / 2;
}

/* Wrenches W (e, 6, m), in rows of `width`, closed: less k d, with d their displacement of the far end. */
LANES void close(chain *c, lanes *W, int64_t width, int64_t m)
{
    lanes *d = c->small, *back = d + 6 * m;
    clear(d, 12 * m);
    for (int64_t e = 0; e < c->e; e++) add_product(c->F + 36 * e, 6, 1, W + 6 * width * e, width, d, m, 6, 6, m);
    add_product(c->k, 6, 1, d, m, back, m, 6, 6, m);
    for (int64_t e = 0; e < c->e; e++)
        for (int64_t i = 0; i < 6; i++)
            for (int64_t j = 0; j < m; j++) W[(6 * e + i) * width + j] -= back[i * m + j];
}

/* Kept motions from forces (e, 12, kept) on the ends i, j of elements: wrenches, closed twice, and their twists. */
LANES void add_kept(chain *c, const double *forces, const double *X, int64_t x_step, const int64_t *turned,
                    const int64_t *design)
{
    const int64_t m = c->kept, width = c->n - 6;
    int64_t lane[4];
    clear(c->B, 6 * c->e * m);
    for (int l = 0; l < 4; l++) lane[l] = design[l] * x_step;
    for (int64_t e = 0; e < c->e; e++)
        for (int64_t end = 0; end < 2; end++) { /* at the node before or behind, if that is an interior one */
            int64_t node = e + end;
            if (node == 0 || node == c->e) continue;
            const double *x = X + 144 * e + 72 * (turned[e] ^ end) + 6 * end, *f = forces + (12 * e + 6 * (turned[e] ^ end)) * m;
            for (int64_t i = 0; i < 6; i++)
                for (int64_t k = 0; k < 6; k++) {
                    lanes a = gathered(x + 12 * k + i, lane);
                    for (int64_t j = 0; j < m; j++) c->B[(6 * (node - 1) + i) * m + j] += a * f[k * m + j];
                }
        }
    for (int64_t e = c->e - 2; e >= 0; e--)
        for (int64_t i = 0; i < 6 * m; i++) c->B[6 * m * e + i] += c->B[6 * m * (e + 1) + i];
    close(c, c->B, m, m);
    close(c, c->B, m, m);
    clear(c->S, 6 * c->e * m);
    for (int64_t e = 0; e < c->e; e++) {
        add_product(c->F + 36 * e, 6, 1, c->B + 6 * m * e, m, c->S + 6 * m * e, m, 6, 6, m);
        if (e + 1 < c->e)
            for (int64_t i = 0; i < 6; i++)
                for (int64_t j = 0; j < m; j++)
                    c->V[(6 * (e + 1) + i) * width + 6 + j] =
                        c->V[(6 * e + i) * width + 6 + j] + c->S[(6 * e + i) * m + j];
    }
}

/* Motions of all nodes for unit relative twists of the ends. */
LANES void move_ends(chain *c)
{
    const int64_t width = c->n - 6;
    clear(c->V, 6 * (c->e + 1) * width);
    for (int64_t e = 1; e < c->e; e++)
        add_product(c->P + 36 * e, 6, 1, c->k, 6, c->V + 6 * width * e, width, 6, 6, 6);
    for (int64_t i = 0; i < 6; i++) c->V[(6 * c->e + i) * width + i] += 1;
}

/* Loads of the mass of one element on its two nodes, and what it adds to the sum of 1/omega^2. */
LANES void add_loads(chain *c, int64_t e, const lanes *aa, const lanes *ab, const lanes *bb)
{
    const int64_t n = c->n, width = n - 6;
    const lanes *Va = c->V + 6 * width * e, *Vb = Va + 6 * width, *Pa = c->P + 36 * e, *Pb = Pa + 36;
    lanes *Wa = c->W + 6 * n * e, *Wb = Wa + 6 * n;
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) {
            Wa[i * n + j] += aa[6 * i + j] + ab[6 * i + j];
            Wb[i * n + j] += ab[6 * j + i] + bb[6 * i + j];
        }
    add_product(aa, 6, 1, Va, width, Wa + 6, n, 6, 6, width);
    add_product(ab, 6, 1, Vb, width, Wa + 6, n, 6, 6, width);
    add_product(ab, 1, 6, Va, width, Wb + 6, n, 6, 6, width);
    add_product(bb, 6, 1, Vb, width, Wb + 6, n, 6, 6, width);
    for (int i = 0; i < 36; i++) c->free += Pa[i] * aa[i] + Pb[i] * bb[i] + 2 * Pa[i] * ab[i];
    for (int i = 0; i < 36; i += 7) c->size += Pa[i] * aa[i] + Pb[i] * bb[i];
}

/* M = V' (loads). */
LANES void add_mass(chain *c)
{
    const int64_t n = c->n, width = n - 6;
    clear(c->M, n * n);
    for (int64_t e = 0; e <= c->e; e++) {
        const lanes *W = c->W + 6 * n * e;
        for (int64_t i = 0; i < 6 * n; i++) c->M[i] += W[i];
        add_product(c->V + 6 * width * e, 1, width, W + 6, n, c->M + 6 * n + 6, n, width, 6, width);
    }
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++)
            c->M[i * n + j] = j < 6 ? c->M[j * n + i] : (c->M[i * n + j] + c->M[j * n + i]) / 2;
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++) c->M[j * n + i] = c->M[i * n + j];
}

/* R = W' F W of the closed wrenches W of the loads on inner nodes, less what kept motions take (n, kept). */
LANES void add_rest(chain *c, const lanes *taken)
{
    const int64_t n = c->n, m = c->kept;
    lanes *FW = c->small;
    for (int64_t i = 0; i < 6 * n; i++) c->W[6 * n * c->e + i] = (lanes){0};
    for (int64_t e = 0; e < c->e; e++) /* loads of the node behind each element, summed from the far end */
        memmove(c->W + 6 * n * e, c->W + 6 * n * (e + 1), 6 * n * sizeof(lanes));
    for (int64_t e = c->e - 2; e >= 0; e--)
        for (int64_t i = 0; i < 6 * n; i++) c->W[6 * n * e + i] += c->W[6 * n * (e + 1) + i];
    close(c, c->W, n, n);
    if (m) { /* amplitudes (kept, n) = k_modes^-1 S' W */
        lanes *right = c->small, *amplitudes = right + m * n;
        clear(right, 2 * m * n);
        for (int64_t e = 0; e < c->e; e++)
            add_product(c->S + 6 * m * e, 1, m, c->W + 6 * n * e, n, right, n, m, 6, n);
        add_product(taken, m, 1, right, n, amplitudes, n, m, m, n);
        for (int64_t i = 0; i < m * n; i++) amplitudes[i] = -amplitudes[i];
        for (int64_t e = 0; e < c->e; e++)
            add_product(c->B + 6 * m * e, m, 1, amplitudes, n, c->W + 6 * n * e, n, 6, m, n);
    }
    clear(c->R, n * n);
    for (int64_t e = 0; e < c->e; e++) {
        const lanes *W = c->W + 6 * n * e;
        clear(FW, 6 * n);
        add_product(c->F + 36 * e, 6, 1, W, n, FW, n, 6, 6, n);
        for (int64_t i = 0; i < n; i += 6) /* the lower half, six rows at a time */
            add_product(W + i, 1, n, FW, n, c->R + i * n, n, n - i < 6 ? n - i : 6, 6, i + 6 < n ? i + 6 : n);
    }
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++)
            c->R[j * n + i] = c->R[i * n + j];
}

/* eq. N9, of F and its inverse k (6, 6). */
LANES lanes lost(const lanes *F, const lanes *k, int64_t count)
{
    lanes spread = {0}, square = {0}, d[6];
    for (int i = 0; i < 6; i++) spread += F[7 * i] * k[7 * i], d[i] = root(absolute(F[7 * i]));
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) {
            lanes off = {0};
            for (int l = 0; l < 6; l++) off += F[6 * i + l] * k[6 * l + j];
            off = (i == j ? off - 1 : off) * d[j] / d[i];
            square += off * off;
        }
    return 6 * 64.0 * (count + 16) * EPS / 2 * spread + root(spread * square) + 16 * EPS * spread;
}

/* Flexibilities, stiffness and motions, mass of one chain, whose elements and turns are given. */
LANES void read_chain(chain *c, const table *flexible, const table *massive, const int64_t *elements,
                      const int64_t *turned, const double *X, int64_t x_step, const double *forces,
                      const int64_t *design, lanes *good)
{
    lanes own[144], m[3][36];
    arms g;
    int64_t lane[4];
    for (int l = 0; l < 4; l++) lane[l] = design[l] * x_step;
    clear(c->P, 36);
    for (int64_t e = 0; e < c->e; e++) {
        expanded(flexible, elements[e], design, own, 36);
        read_arms(X + 144 * e, lane, turned[e], &g);
        moved_flexibility(own, &g, turned[e] ? g.a : g.b, c->F + 36 * e);
        for (int i = 0; i < 36; i++) c->P[36 * (e + 1) + i] = c->P[36 * e + i] + c->F[36 * e + i];
    }
    inverted(c->P + 36 * c->e, 6, 6, c->small, c->k, good);
    move_ends(c);
    if (c->kept) add_kept(c, forces, X, x_step, turned, design);
    clear(c->W, 6 * (c->e + 1) * c->n);
    c->free = c->size = (lanes){0};
    for (int64_t e = 0; e < c->e; e++) {
        const int64_t row[3] = {6 * turned[e], 6 * turned[e], 6 - 6 * turned[e]};
        expanded(massive, elements[e], design, own, 144);
        read_arms(X + 144 * e, lane, turned[e], &g);
        for (int k = 0; k < 3; k++) /* of ends a and a, a and b, b and b */
            moved_mass(own + 12 * row[k] + (k ? row[2] : row[0]), &g, k < 2 ? g.a : g.b, k ? g.b : g.a, m[k]);
        add_loads(c, e, m[0], m[1], m[2]);
    }
    add_mass(c);
}

/* Sum of 1/omega^2 of what is left out, from above, and the loss; k_modes (kept, kept) with its inverse behind it. */
LANES lanes slowest(chain *c, const lanes *k_modes, lanes loss)
{
    const lanes *total = c->P + 36 * c->e, *held = c->M + 6 * c->n + 6;
    const int64_t n = c->n, m = c->kept;
    lanes back = {0}, size = c->size;
    for (int i = 0; i < 6; i++) {
        size += total[7 * i] * held[i * n + i];
        for (int j = 0; j < 6; j++) back += total[6 * i + j] * held[i * n + j];
    }
    lanes slow = c->free - back + 6 * (3 * (c->e + 64) * EPS + loss) * size, of_kept = {0};
    for (int64_t i = 0; i < m; i++)
        for (int64_t j = 0; j < m; j++) of_kept += k_modes[m * m + i * m + j] * c->M[(12 + j) * n + 12 + i];
    return slow - of_kept + 64 * m * EPS * of_kept;
}

/* A (2 or 3, designs, chains, n, n): K, M and R of chains of equal length, slowness and loss (designs, chains) beside R.

Of elements (chains, e): whether they are `turned`, walked from j to i, and X (chains, e, 12, 12). `sizes` are those of
a table of elements, coefficients of flexibility and mass with how many entries of their bases are not zero, the steps
from design to design of both and of X, zero where nothing varies; then designs, chains, e, kept, and matrices wanted.
Returns how many chains have a flexibility that is not positive: their slowness is no number, and nothing of them can be
used. */
KERNEL int64_t chain_moments(const double *flexibility, const double *flexibility_basis,
                             const int64_t *flexibility_places, const double *mass, const double *mass_basis,
                             const int64_t *mass_places, const int64_t *elements, const int64_t *turned,
                             const double *X, const double *forces, const int64_t *sizes, double *scratch, double *A,
                             double *slowness, double *loss)
{
    const table flexible = {flexibility, flexibility_basis, flexibility_places, sizes[2], sizes[0], sizes[1]};
    const table massive = {mass, mass_basis, mass_places, sizes[5], sizes[3], sizes[4]};
    const int64_t x_step = sizes[6], designs = sizes[7], chains = sizes[8], e = sizes[9], m = sizes[10];
    const int64_t n = 12 + m, matrices = sizes[11];
    int64_t bad = 0;
    lanes *at = aligned(scratch);
    chain c = {.e = e, .n = n, .kept = m};
    c.F = at, c.P = c.F + 36 * e, c.V = c.P + 36 * (e + 1), c.W = c.V + 6 * (e + 1) * (n - 6);
    c.B = c.W + 6 * (e + 1) * n, c.S = c.B + 6 * e * m, c.M = c.S + 6 * e * m, c.R = c.M + n * n, c.k = c.R + n * n;
    lanes *k_modes = c.k + 36;
    c.small = k_modes + 2 * m * m;
    for (int64_t first = 0; first < designs; first += 4)
        for (int64_t i = 0; i < chains; i++) {
            lanes good = {1, 1, 1, 1}, lossy = {0}, slow = {0};
            int64_t design[4], here = designs - first < 4 ? designs - first : 4;
            offsets(first, designs, 1, design);
            read_chain(&c, &flexible, &massive, elements + i * e, turned + i * e, X + 144 * i * e, x_step,
                       forces + 12 * i * e * m, design, &good);
            clear(k_modes, 2 * m * m);
            for (int64_t k = 0; m && k < e; k++)
                add_product(c.B + 6 * m * k, 1, m, c.S + 6 * m * k, m, k_modes, m, m, 6, m);
            if (m) inverted(k_modes, m, m, c.small, k_modes + m * m, &good);
            if (matrices == 3) {
                lossy = lost(c.P + 36 * e, c.k, e);
                slow = slowest(&c, k_modes, lossy);
                add_rest(&c, k_modes + m * m);
            }
            for (int64_t l = 0; l < here; l++) {
                const int64_t number = (first + l) * chains + i, all = designs * chains * n * n;
                double *K = A + number * n * n, *M = K + all, *R = M + all;
                for (int64_t r = 0; r < n * n; r++) K[r] = 0, M[r] = c.M[r][l];
                for (int r = 0; r < 36; r++) K[(6 + r / 6) * n + 6 + r % 6] = c.k[r][l];
                for (int64_t r = 0; r < m * m; r++) K[(12 + r / m) * n + 12 + r % m] = k_modes[r][l];
                for (int64_t r = 0; matrices == 3 && r < n * n; r++) R[r] = c.R[r][l];
                if (matrices == 3) slowness[number] = slow[l], loss[number] = lossy[l];
                if (good[l] == 0) slowness[number] = NAN, bad++;
            }
        }
    return bad;
}
