/* Sums over modes, H = sum_k R_k / (omega_k^2 - w^2 + i (w d_k + l_k sgn w)), theory eq. T10. */
#include "flexura.h"

enum { MODES = 64 }; /* modes whose factors are worked out at a time */

/* Factors 1/(...) = a - i b of some modes at four frequencies w. */
static inline void factors(const double *w, int64_t modes, const double *square, const double *damping,
                           const double *loss, four *a, four *b)
{
    four w4 = AT(w, 0), sign = {0};
    for (int j = 0; j < 4; j++) sign[j] = (w[j] > 0) - (w[j] < 0);
    for (int64_t k = 0; k < modes; k++) {
        four stiff = square[k] - w4 * w4, lossy = damping[k] * w4 + loss[k] * sign;
        four inverse = 1.0 / (stiff * stiff + lossy * lossy);
        a[k] = stiff * inverse;
        b[k] = lossy * inverse;
    }
}

/* H (n, p) complex at w (n) from modes with omega^2, damping and loss (r) and residues (r, q), q a multiple of four.
Entry j of H is of residue from[j]. `sums` has 8 q numbers, `ends` 4: frequencies are taken four by four, the last ones
with what fills the four up. */
KERNEL int64_t modal_sum(const double *w, int64_t n, const double *square, const double *damping, const double *loss,
                         int64_t r, const double *residues, int64_t q, const int64_t *from, int64_t p, double *sums,
                         double *ends, double *H)
{
    four a[MODES], b[MODES];
    for (int64_t i = 0; i < n; i += 4) {
        int64_t count = n - i < 4 ? n - i : 4;
        for (int64_t f = 0; f < 4; f++) ends[f] = w[i + (f < count ? f : 0)];
        memset(sums, 0, 8 * q * sizeof *sums);
        for (int64_t start = 0; start < r; start += MODES) {
            int64_t modes = r - start < MODES ? r - start : MODES;
            factors(ends, modes, square + start, damping + start, loss + start, a, b);
            for (int64_t j = 0; j < q; j += 4) {
                const double *R = residues + start * q + j;
                four real[4], imag[4];
                for (int f = 0; f < 4; f++) real[f] = AT(sums, 2 * f * q + j), imag[f] = AT(sums, (2 * f + 1) * q + j);
                for (int64_t k = 0; k < modes; k++, R += q) {
                    four row = AT(R, 0);
                    for (int f = 0; f < 4; f++) real[f] += a[k][f] * row, imag[f] -= b[k][f] * row;
                }
                for (int f = 0; f < 4; f++) PUT(sums, 2 * f * q + j) = real[f], PUT(sums, (2 * f + 1) * q + j) = imag[f];
            }
        }
        for (int64_t f = 0; f < count; f++) {
            const double *real = sums + 2 * f * q, *imag = real + q;
            double *out = H + 2 * (i + f) * p;
            for (int64_t j = 0; j < p; j++) out[2 * j] = real[from[j]], out[2 * j + 1] = imag[from[j]];
        }
    }
    return 0;
}
