/* Eigenpairs of small symmetric pencils A z = lambda B z by Cholesky's factors of B and Jacobi's rotations (Golub and
Van Loan 2013, sec. 8.5), lanes pencils at a time, one in each lane. */
#include "lanes.h"

enum { SWEEPS = 20 };

/* C = L^-1 A L^-T (n, n) of A and B scaled by d to a diagonal of ones of B, with L^-1. */
LANES void reduced(const lanes *A, const lanes *B, int64_t n, lanes *d, lanes *inverse, lanes *L, lanes *half, lanes *C,
                   lanes *good)
{
    unit_scale(B, n, n, d);
    clear(L, n * n);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j <= i; j++) L[i * n + j] = B[j * n + i] * d[i] * d[j];
    factored(L, n, n, inverse, good);
    turned_over(L, n, inverse);
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < n; j++) {
            four sum = {0}; /* of the upper half of A */
            for (int64_t k = 0; k <= i; k++) sum += L[i * n + k] * A[k < j ? k * n + j : j * n + k] * d[k] * d[j];
            half[i * n + j] = sum;
        }
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j <= i; j++) {
            lanes sum = {0};
            for (int64_t k = 0; k <= j; k++) sum += half[i * n + k] * L[j * n + k];
            C[i * n + j] = C[j * n + i] = sum;
        }
}

/* Turn rows and columns p, q of C, and rows of V, until C_pq is zero, in the lanes where that is not small already, so
that no lane depends on others; whether there was any. */
LANES int turn(lanes *C, lanes *V, int64_t n, int64_t p, int64_t q, lanes tiny)
{
    const lanes off = C[p * n + q], a = C[p * n + p], b = C[q * n + q], size = root(absolute(a * b));
    lanes t = {0}, left = off;
    int any = 0;
    for (int l = 0; l < 4; l++) {
        if (!(fabs(off[l]) > EPS * size[l] && fabs(off[l]) > tiny[l])) continue;
        double ratio = (b[l] - a[l]) / (2 * off[l]);
        t[l] = (ratio < 0 ? -1 : 1) / (fabs(ratio) + sqrt(1 + ratio * ratio));
        left[l] = 0, any = 1;
    }
    if (!any) return 0;
    const lanes c = 1 / root(1 + t * t), s = t * c;
    for (int64_t k = 0; k < n; k++) {
        lanes x = V[p * n + k], y = V[q * n + k];
        V[p * n + k] = c * x - s * y, V[q * n + k] = s * x + c * y;
        if (k == p || k == q) continue;
        x = C[p * n + k], y = C[q * n + k];
        C[p * n + k] = C[k * n + p] = c * x - s * y;
        C[q * n + k] = C[k * n + q] = s * x + c * y;
    }
    C[p * n + p] = a - t * off, C[q * n + q] = b + t * off;
    C[p * n + q] = C[q * n + p] = left;
    return 1;
}

/* values (k, n), ascending, and vectors (k, n, n), B-orthonormal, of A and B (k, n, n), of whose upper halves A is read;
`sizes` are k and n, scratch is of (6 n n + 2 n) lanes. Which pencils have a definite B, and have come to rest, is
told in `good` (k); others have nothing that can be used. Returns how many these are. */
KERNEL int64_t small_pencils(const double *A, const double *B, const int64_t *sizes, double *scratch, double *values,
                             double *vectors, int64_t *good)
{
    const int64_t count = sizes[0], n = sizes[1], nn = n * n;
    int64_t bad = 0;
    lanes *a = aligned(scratch), *b = a + nn, *L = b + nn, *C = L + nn, *V = C + nn, *half = V + nn, *d = half + nn;
    for (int64_t first = 0; first < count; first += 4) {
        int64_t at[4], turned = 1;
        lanes is_good = {1, 1, 1, 1}, tiny = {0};
        offsets(first, count, nn, at);
        for (int64_t i = 0; i < nn; i++) a[i] = gathered(A + i, at), b[i] = gathered(B + i, at), V[i] = (lanes){0};
        reduced(a, b, n, d, d + n, L, half, C, &is_good);
        for (int64_t i = 0; i < n; i++) V[i * n + i] += 1, tiny = larger(tiny, absolute(C[i * n + i]));
        tiny *= EPS * EPS;
        for (int sweep = 0; turned && sweep < SWEEPS; sweep++) {
            turned = 0;
            for (int64_t p = 0; p < n; p++)
                for (int64_t q = p + 1; q < n; q++) turned |= turn(C, V, n, p, q, tiny);
        }
        clear(half, nn); /* d L^-T V', vectors in rows */
        add_product(V, n, 1, L, n, half, n, n, n, n);
        for (int64_t l = 0; l < 4 && first + l < count; l++) {
            double *own = values + (first + l) * n, *Z = vectors + (first + l) * nn;
            int64_t order[64], is_finite = is_good[l] != 0;
            for (int64_t i = 0; i < n; i++) {
                int64_t j = i;
                for (; j > 0 && C[order[j - 1] * (n + 1)][l] > C[i * (n + 1)][l]; j--) order[j] = order[j - 1];
                order[j] = i;
            }
            for (int64_t i = 0; i < n; i++) {
                own[i] = C[order[i] * (n + 1)][l];
                is_finite &= isfinite(own[i]) != 0;
                for (int64_t j = 0; j < n; j++) Z[j * n + i] = half[order[i] * n + j][l] * d[j][l];
            }
            good[first + l] = is_finite && !turned;
            bad += !good[first + l];
        }
    }
    return bad;
}
