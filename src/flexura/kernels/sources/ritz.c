/* Branches that follow the core, their Ritz vectors, theory eq. N14, and projections of K, M and R on these, eq. N15. */
#include "branches.h"

/* in place of a trace of none */
#define LEAST (EPS * EPS * EPS * EPS)

/* Of A (matrices, designs, q, n, n) with `inside` coordinates first, of four designs at a time: the flexibility G
(designs, q, inside, inside) of these, the motion (designs, q, n, i) of all for unit displacements of the others, A of
it (matrices, designs, q, i, i), and traces (designs, q) of G M. `sizes` are designs, matrices, q, n and inside; scratch
has 4 (7 n n + 3 n) numbers. Returns how many insides are not positive definite: their trace is no number, and nothing of them can be used. */
KERNEL int64_t branches_followed(const double *A, const int64_t *sizes, double *scratch, double *G, double *motion,
                                 double *followed, double *trace)
{
    const int64_t designs = sizes[0], matrices = sizes[1], q = sizes[2], n = sizes[3], m = sizes[4], i = n - m;
    branch b = {.r = 0, .n = n, .inside = m, .A = aligned(scratch)};
    lanes *inner = b.A + 3 * n * n, *moved = inner + n * n, *half = moved + n * n, *small = half + n * n;
    int64_t bad = 0;
    for (int64_t first = 0; first < designs; first += 4)
        for (int64_t k = 0; k < q; k++) {
            const int64_t here = designs - first < 4 ? designs - first : 4;
            lanes good = {1, 1, 1, 1}, sum = {0};
            read_branch(&b, A, 0, 0, 0, matrices, first, designs, q, k);
            inverted(b.A, m, n, small, inner, &good);
            clear(moved, n * i);
            add_product(inner, m, 1, b.A + m, n, moved, i, m, m, i);
            for (int64_t j = 0; j < m * i; j++) moved[j] = -moved[j];
            for (int64_t j = 0; j < i; j++) moved[(m + j) * i + j] += 1;
            for (int64_t j = 0; j < m; j++)
                for (int64_t l = 0; l < m; l++) sum += inner[j * m + l] * b.A[n * n + j * n + l];
            for (int64_t s = 0; s < matrices; s++) {
                clear(half, n * i), clear(small, i * i);
                add_product(b.A + s * n * n, n, 1, moved, i, half, i, n, n, i);
                add_product(moved, 1, i, half, i, small, i, i, n, i);
                for (int64_t d = 0; d < here; d++)
                    for (int64_t j = 0; j < i * i; j++)
                        followed[((s * designs + first + d) * q + k) * i * i + j] = small[j][d];
            }
            for (int64_t d = 0; d < here; d++) {
                const int64_t number = (first + d) * q + k;
                for (int64_t j = 0; j < m * m; j++) G[number * m * m + j] = inner[j][d];
                for (int64_t j = 0; j < n * i; j++) motion[number * n * i + j] = moved[j][d];
                trace[number] = good[d] != 0 ? sum[d] : NAN;
                bad += good[d] == 0;
            }
        }
    return bad;
}

/* Add T' A T (c, c) of A (matrices, designs, q, i, i) and r maps T (q, r, i, c) each, `sizes[6]` from design to design,
to C (matrices, designs, c, c). `sizes` are matrices, designs, q, r, i, c and that step; scratch is of (i i + (r + 1) i c
+ c c) lanes. */
KERNEL int64_t branches_placed(const double *A, const double *T, const int64_t *sizes, double *scratch, double *C)
{
    const int64_t designs = sizes[1], q = sizes[2], i = sizes[4], c = sizes[5];
    branch b = {.r = sizes[3], .n = i, .inside = 0, .c = c, .A = aligned(scratch)};
    b.T = b.A + i * i;
    lanes *half = b.T + b.r * i * c, *sum = half + i * c;
    for (int64_t s = 0; s < sizes[0]; s++)
        for (int64_t first = 0; first < designs; first += 4) {
            clear(sum, c * c);
            for (int64_t k = 0; k < q; k++) {
                read_branch(&b, A + s * designs * q * i * i, 0, T, sizes[6], 1, first, designs, q, k);
                placed(&b, b.A, 0, half, sum, 0);
            }
            for (int64_t d = 0; d < 4 && first + d < designs; d++)
                for (int64_t j = 0; j < c * c; j++) C[((s * designs) + first + d) * c * c + j] += sum[j][d];
        }
    return 0;
}

/* Ritz vectors X (n, p) of a branch from displacements of its ends (i, p): static motion, and the response to its own
inertia as a series of `terms`, with lam (p). GMV (inside, i) and GM (inside, inside) are G M of both. */
LANES void ritz_vectors(const branch *b, const lanes *motion, const lanes *GMV, const lanes *GM, const lanes *ends,
                        const lanes *lam, int64_t p, int64_t terms, lanes *now, lanes *next, lanes *X)
{
    const int64_t m = b->inside, i = b->n - m;
    clear(X, b->n * p), clear(now, m * p);
    add_product(motion, i, 1, ends, p, X, p, m, i, p);
    for (int64_t j = 0; j < i * p; j++) X[m * p + j] = ends[j];
    add_product(GMV, i, 1, ends, p, now, p, m, i, p);
    for (int64_t term = 0; term < terms; term++) {
        for (int64_t j = 0; j < m; j++)
            for (int64_t k = 0; k < p; k++) now[j * p + k] *= lam[k], X[(j * p + k)] += now[j * p + k];
        if (term + 1 == terms) break;
        clear(next, m * p);
        add_product(GM, m, 1, now, p, next, p, m, m, p);
        memcpy(now, next, m * p * sizeof *now);
    }
}

/* Add X' A X of K, M and R to small (matrices, p, p), and what K and M may be off to `off` (2, p). `part` is the
round-off of their diagonals. */
LANES void project(const branch *b, int64_t matrices, const lanes *X, const lanes *core, int64_t r, int64_t p, double part,
                   lanes *half, lanes *small, lanes *off)
{
    const int64_t n = b->n, m = b->inside, c = b->c;
    for (int64_t s = 0; s < matrices; s++) {
        clear(half, n * p);
        add_product(b->A + s * n * n, n, 1, X, p, half, p, n, n, p);
        add_product(X, 1, p, half, p, small + s * p * p, p, p, n, p);
    }
    for (int64_t j = 0; off && j < n; j++)
        for (int64_t k = 0; k < p; k++) {
            lanes size = absolute(X[j * p + k]);
            if (j >= m) {
                const lanes *T = b->T + (r * (n - m) + j - m) * c;
                size = (lanes){0};
                for (int64_t l = 0; l < c; l++) size += absolute(T[l]) * absolute(core[l * p + k]);
            }
            for (int64_t s = 0; s < 2; s++)
                off[s * p + k] += (b->slack[s * n + j] + part * absolute(b->A[s * n * n + j * n + j])) * size * size;
        }
}

/* Add the projections of branches A (matrices, designs, q, n, n) on vectors that follow the core's Z (designs, c, p),
and those of what the core has by itself (matrices, designs, c, c), if that is given, on Z, to small (designs, matrices,
p, p), and what they may be off to `off` (designs, 2, p) where there is R. G, motion and trace (designs, q) are those of
`branches_followed`; lam is the lesser of `values` (designs, p) and of `reach` over the largest trace. `sizes` are
designs, matrices, q, r, n, inside, c, p, the step of T and terms; scratch is of ((8 n + r c + 3) n + (4 n + c + 3 p + 3)
p + 2 n max(n, p) + (3 c + p + 3) c) lanes. */
KERNEL int64_t branches_projected(const double *A, const double *slack, const double *T, const double *G,
                                  const double *motion, const double *trace, const double *alone,
                                  const double *alone_slack, const double *Z, const double *values, double reach,
                                  const int64_t *sizes, double *scratch, double *small, double *off)
{
    const int64_t designs = sizes[0], matrices = sizes[1], q = sizes[2], n = sizes[4], m = sizes[5], i = n - m;
    const int64_t c = sizes[6], p = sizes[7], pp = p * p, wide = n > p ? n : p;
    branch b = {.r = sizes[3], .n = n, .inside = m, .c = c, .A = aligned(scratch)};
    b.slack = b.A + 3 * n * n, b.T = b.slack + 3 * n;
    lanes *GM = b.T + b.r * i * c, *V = GM + m * m, *GMV = V + n * i, *core = GMV + m * i, *own = core + c * p;
    lanes *ends = own + p, *X = ends + i * p, *now = X + n * p, *half = now + n * wide, *sum = half + n * wide;
    lanes *error = sum + 3 * pp, *rest = error + 2 * p;
    branch whole = {.r = 0, .n = c, .inside = c, .c = c, .A = rest + c * p, .slack = rest + c * (p + 3 * c)};
    const double part = (double)(n * (n + q * b.r + 2 * p + 16)) * EPS;
    int64_t at[4];
    for (int64_t first = 0; first < designs; first += 4) {
        offsets(first, designs, c * p, at);
        for (int64_t j = 0; j < c * p; j++) core[j] = gathered(Z + j, at);
        offsets(first, designs, p, at);
        for (int64_t j = 0; j < p; j++) own[j] = gathered(values + j, at);
        clear(sum, 3 * pp), clear(error, 2 * p);
        lanes slowest = {LEAST, LEAST, LEAST, LEAST};
        offsets(first, designs, q, at);
        for (int64_t k = 0; k < q; k++) slowest = larger(gathered(trace + k, at), slowest);
        for (int64_t j = 0; j < p; j++) own[j] = -larger(-own[j], -reach / slowest);
        if (alone) {
            read_branch(&whole, alone, matrices == 3 ? alone_slack : 0, 0, 0, matrices, first, designs, 1, 0);
            project(&whole, matrices, core, core, 0, p, (double)(c * (c + 1 + 2 * p + 16)) * EPS, rest, sum,
                    matrices == 3 ? error : 0);
        }
        for (int64_t k = 0; k < q; k++) {
            read_branch(&b, A, matrices == 3 ? slack : 0, T, sizes[8], matrices, first, designs, q, k);
            offsets(first, designs, q * n * i, at);
            for (int64_t j = 0; m && j < n * i; j++) V[j] = gathered(motion + k * n * i + j, at);
            offsets(first, designs, q * m * m, at);
            for (int64_t j = 0; j < m * m; j++) half[j] = gathered(G + k * m * m + j, at);
            clear(GM, m * m), clear(now, m * i), clear(GMV, m * i);
            add_product(half, m, 1, b.A + n * n, n, GM, m, m, m, m);
            add_product(b.A + n * n, n, 1, V, i, now, i, m, n, i);
            add_product(half, m, 1, now, i, GMV, i, m, m, i);
            for (int64_t r = 0; r < b.r; r++) {
                clear(ends, i * p);
                add_product(b.T + r * i * c, c, 1, core, p, ends, p, i, c, p);
                ritz_vectors(&b, V, GMV, GM, ends, own, p, sizes[9], now, half, X);
                project(&b, matrices, X, core, r, p, part, half, sum, matrices == 3 ? error : 0);
            }
        }
        for (int64_t d = 0; d < 4 && first + d < designs; d++) {
            for (int64_t j = 0; j < matrices * pp; j++) small[(first + d) * matrices * pp + j] += sum[j][d];
            for (int64_t j = 0; matrices == 3 && j < 2 * p; j++) off[(first + d) * 2 * p + j] += error[j][d];
        }
    }
    return 0;
}
