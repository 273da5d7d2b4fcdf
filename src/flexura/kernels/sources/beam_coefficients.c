/* The numbers of which flexibility and mass of uniform beams are linear combinations, theory eqs. 12, 14 and 19. */
#include <float.h>

#include "flexura.h"

/* of the mass: translation and twist, and of both planes v and theta with themselves */
#define ON_DIAGONAL(k) ((k) < 3 || (k) == 6 || (k) == 8 || (k) == 12)

#define ROW(name, of, k) const double *name = of + (k) * count

/* flexibility (count, 8) and mass (count, 14) of beams: E, G, rho in rows of `count`, A, Iy, Iz, J, ky, kz of the effective
sections `stiff` and of the actual ones, `lengths` lengths and n flags, which are the same for all that follow, and
polynomials (6, 6) of phi for each of the six numbers of a plane. Returns how many
beams have no positive and finite flexibility, or no finite mass that is not negative, on the diagonal. */
KERNEL int64_t beam_coefficients(const double *moduli, const double *stiff, const double *actual, const double *length,
                                 const double *shear, const double *rotary, const double *polynomials, int64_t count,
                                 int64_t lengths, int64_t n, double *flexibility, double *mass)
{
    ROW(E, moduli, 0); ROW(G, moduli, 1); ROW(rho, moduli, 2);
    ROW(A, stiff, 0); ROW(Iy, stiff, 1); ROW(Iz, stiff, 2); ROW(J, stiff, 3); ROW(ky, stiff, 4); ROW(kz, stiff, 5);
    ROW(area, actual, 0); ROW(inertia_y, actual, 1); ROW(inertia_z, actual, 2);
    int64_t bad = 0;
    for (int64_t i = 0; i < count; i++, flexibility += 8, mass += 14) {
        const double L = length[i % lengths], half = L * L / 2, third = L * L * L / 3, slide = shear[i % n] * L / (G[i] * A[i]);
        const double by = 1 / (E[i] * Iy[i]), bz = 1 / (E[i] * Iz[i]);
        flexibility[0] = L / (E[i] * A[i]), flexibility[1] = L / (G[i] * J[i]);
        flexibility[2] = third * bz + slide / ky[i], flexibility[3] = half * bz, flexibility[4] = L * bz;
        flexibility[5] = third * by + slide / kz[i], flexibility[6] = half * by, flexibility[7] = L * by;
        const double line = rho[i] * L, unit[6] = {1, L, 1, L, L * L, L * L};
        const double factor = 12 * shear[i % n] * E[i] / (G[i] * A[i] * (L * L));
        mass[0] = line * area[i], mass[1] = line * (inertia_y[i] + inertia_z[i]);
        for (int plane = 0; plane < 2; plane++) {
            const double phi = plane ? factor * Iy[i] / kz[i] : factor * Iz[i] / ky[i];
            const double scale = line / ((1 + phi) * (1 + phi)), t = scale * area[i];
            const double r = rotary[i % n] * scale * (plane ? inertia_y[i] : inertia_z[i]) / (L * L);
            const double weights[6] = {t, t * phi, t * phi * phi, r, r * phi, r * phi * phi};
            for (int k = 0; k < 6; k++) {
                double sum = 0;
                for (int w = 0; w < 6; w++) sum += weights[w] * polynomials[6 * w + k];
                mass[2 + 6 * plane + k] = sum * unit[k];
            }
        }
        int good = 1; /* no number is neither */
        for (int k = 0; k < 8; k++) good &= k == 3 || k == 6 || (flexibility[k] >= DBL_MIN && flexibility[k] < HUGE_VAL);
        for (int k = 0; k < 14; k++) good &= !ON_DIAGONAL(k) || (mass[k] >= 0 && mass[k] < HUGE_VAL);
        bad += !good;
    }
    return bad;
}
