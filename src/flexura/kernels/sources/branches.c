/* Branches of an arrow: eliminated at values below eigenvalues, theory eqs. N12 and N13. Four designs at a time, one in
each lane. What is taken off for round-off, eqs. N10 and N11, is given as parts of the sizes: of the ten roundings that
N11 has beside a factorisation's own, one is that of the reciprocals of its diagonal. */
#include "branches.h"

/* B = K - ell M - h R (n, n), its lower half, with the sum of the sizes of its diagonals and the error (n) left. */
LANES void dynamic(const lanes *A, const lanes *slack, int64_t n, lanes ell, lanes h, lanes *B, lanes *size, lanes *error)
{
    const lanes *K = A, *M = K + n * n, *R = M + n * n;
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j <= i; j++) B[i * n + j] = K[i * n + j] - ell * M[i * n + j] - h * R[i * n + j];
        size[i] = K[i * n + i] + ell * M[i * n + i] + h * R[i * n + i];
        error[i] = slack[i] + ell * slack[n + i] + h * slack[2 * n + i];
    }
}

/* h of eq. N7, which multiplies R. */
LANES lanes response(lanes ell, lanes slowness)
{
    return ell * ell / (1 - ell * slowness) * (1 + 1e-9);
}

/* S (i, i), no more than what a branch adds to its ends, from B, and a (i) with |S_jk| <= sqrt(a_j a_k); `shift` (i) has
been added to the diagonal of the ends, `good` tells where the inside is proven positive definite. */
LANES void eliminated(lanes *B, int64_t n, int64_t inside, const lanes *shift, lanes *inverse, lanes *S, lanes *a, lanes *good)
{
    const int64_t ends = n - inside;
    factored(B, n, n, inverse, good);
    for (int64_t i = 0; i < ends; i++)
        for (int64_t j = 0; j <= i; j++) {
            lanes sum = {0};
            for (int64_t k = 0; k <= j; k++) sum += B[(inside + i) * n + inside + k] * B[(inside + j) * n + inside + k];
            for (int l = 0; l < 4; l++)
                if ((*good)[l] == 0) sum[l] = NAN;
            S[i * ends + j] = S[j * ends + i] = sum;
        }
    for (int64_t i = 0; i < ends; i++) {
        a[i] = S[i * ends + i] + shift[i];
        S[i * ends + i] -= shift[i];
    }
}

/* Add what branches are worth at ell (designs, j) to S (designs, j, c, c), with size and error (designs, j, c); S is no
number where an inside is not proven positive definite. `followed` (3, designs, q, i, i) are those of static motions.
`sizes` are designs, j, q, r, n, inside, c, and the step of T; scratch is of (4 n (n + 2) + r i c + 3 i (i + c + 2) + c
(c + 1)) lanes. */
KERNEL int64_t branches_eliminated(const double *A, const double *slack, const double *T, const double *followed,
                                   const double *ell, const double *slowness, double placing_rounding,
                                   double rounding, const int64_t *sizes, double *scratch, double *S, double *size, double *error)
{
    const int64_t designs = sizes[0], count = sizes[1], q = sizes[2], n = sizes[4], ends = n - sizes[5], c = sizes[6];
    branch b = {.r = sizes[3], .n = n, .inside = sizes[5], .c = c, .A = aligned(scratch)};
    b.slack = b.A + 3 * n * n, b.T = b.slack + 3 * n;
    lanes *B = b.T + b.r * ends * c, *own = B + n * n, *off = own + n, *inverse = off + n, *inner = inverse + n;
    lanes *a = inner + ends * ends, *shift = a + ends, *mass = shift + ends, *half = mass + 2 * ends;
    lanes *C = half + ends * c, *added = C + c * c;
    const double part = (placing_rounding + (double)(q * b.r) * EPS) * (double)ends;
    int64_t at[4], each[4], one[4];
    for (int64_t first = 0; first < designs; first += 4) {
        const int64_t here = designs - first < 4 ? designs - first : 4;
        offsets(first, designs, q * ends * ends, at);
        offsets(first, designs, count, each);
        offsets(first, designs, 1, one);
        for (int64_t k = 0; k < q; k++) {
            read_branch(&b, A, slack, T, sizes[7], 3, first, designs, q, k);
            for (int64_t s = 0; s < 2; s++)
                for (int64_t i = 0; i < ends; i++)
                    mass[s * ends + i] =
                        gathered(followed + (((s + 1) * designs * q + k) * ends + i) * ends + i, at);
            for (int64_t j = 0; j < count; j++) {
                lanes good = {1, 1, 1, 1}, l = gathered(ell + j, each), h = response(l, gathered(slowness, one));
                dynamic(b.A, b.slack, n, l, h, B, own, off);
                for (int64_t i = 0; i < n; i++) {
                    lanes more = {0};
                    if (i >= b.inside) {
                        more = 4.0 * ends * (l * mass[i - b.inside] + h * mass[ends + i - b.inside]);
                        shift[i - b.inside] = more;
                    }
                    B[i * n + i] += more - off[i] - rounding * (own[i] + more);
                }
                eliminated(B, n, b.inside, shift, inverse, inner, a, &good);
                clear(C, c * (c + 1));
                placed(&b, inner, a, half, C, added);
                for (int64_t d = 0; d < here; d++) {
                    const int64_t number = (first + d) * count + j;
                    for (int64_t i = 0; i < c * c; i++) S[number * c * c + i] += C[i][d];
                    for (int64_t i = 0; i < c; i++) {
                        size[number * c + i] += added[i][d];
                        error[number * c + i] += part * added[i][d];
                    }
                }
            }
        }
    }
    return 0;
}

/* Of which designs and ell (designs, j) fewer than j + 1 eigenvalues of A (3, designs, c, c), with `slack` (3, designs,
c), and of what branches add, S, size and error, are proven to lie below: eqs. N8, N11, N13 with V (designs, c, p).
`sizes` are designs, j, c and p; scratch is of (5 c (c + 2) + c p) lanes. */
KERNEL int64_t core_has_fewer(const double *A, const double *slack, const double *V, const double *ell,
                              const double *slowness, const double *S, const double *size, const double *error,
                              double rounding, const int64_t *sizes, double *scratch, int64_t *proven)
{
    const int64_t designs = sizes[0], count = sizes[1], c = sizes[2], p = sizes[3], cc = c * c;
    lanes *core = aligned(scratch), *slacks = core + 3 * cc, *B = slacks + 3 * c, *own = B + cc, *off = own + c;
    lanes *moved = off + c, *inverse = moved + c, *v = inverse + c;
    int64_t at[4], row[4], each[4], one[4], modes[4];
    for (int64_t first = 0; first < designs; first += 4) {
        const int64_t here = designs - first < 4 ? designs - first : 4;
        branch b = {.r = 0, .n = c, .inside = c, .c = c, .A = core, .slack = slacks};
        read_branch(&b, A, slack, 0, 0, 3, first, designs, 1, 0);
        offsets(first, designs, c * p, modes);
        for (int64_t i = 0; i < c * p; i++) v[i] = gathered(V + i, modes);
        offsets(first, designs, count * cc, at);
        offsets(first, designs, count * c, row);
        offsets(first, designs, count, each);
        offsets(first, designs, 1, one);
        for (int64_t j = 0; j < count; j++) {
            lanes good = {1, 1, 1, 1}, l = gathered(ell + j, each), h = response(l, gathered(slowness, one));
            dynamic(core, slacks, c, l, h, B, own, off);
            for (int64_t i = 0; i < c; i++) {
                for (int64_t k = 0; k <= i; k++)
                    B[k * c + i] = B[i * c + k] = B[i * c + k] + gathered(S + j * cc + i * c + k, at);
                own[i] += gathered(size + j * c + i, row), off[i] += gathered(error + j * c + i, row);
            }
            for (int64_t i = 0; i < j; i++) {
                lanes energy = {0}, factor = {0};
                clear(moved, c);
                add_product(B, c, 1, v + i, p, moved, 1, c, c, 1);
                for (int64_t k = 0; k < c; k++) energy -= moved[k] * v[k * p + i];
                for (int d = 0; d < 4; d++)
                    if (energy[d] > 0) factor[d] = sqrt(2 / energy[d]);
                for (int64_t k = 0; k < c; k++) moved[k] *= factor;
                for (int64_t k = 0; k < c; k++) {
                    for (int64_t m = 0; m < c; m++) B[k * c + m] += moved[k] * moved[m];
                    own[k] += moved[k] * moved[k];
                }
            }
            for (int64_t i = 0; i < c; i++) B[i * c + i] -= off[i] + rounding * own[i];
            factored(B, c, c, inverse, &good);
            for (int64_t d = 0; d < here; d++) proven[(first + d) * count + j] = good[d] != 0;
        }
    }
    return 0;
}
