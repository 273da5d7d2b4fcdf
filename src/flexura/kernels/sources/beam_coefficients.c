/* The numbers of which flexibility and mass of uniform beams are linear combinations, theory eqs. 12 and 19. */
#include "flexura.h"

/* Arrays of n elements of each design, `steps` apart from design to design: zero where it is the same for all. */
#define OF(name, k) const double *name = given[k] + d * steps[k]

/* out (designs, n, 8) from E, G, A, Iy, Iz, J, ky, kz, length and shear: eq. 12. */
KERNEL int64_t flexibility_numbers(const double *const *given, const int64_t *steps, int64_t designs, int64_t n,
                                   double *out)
{
    for (int64_t d = 0; d < designs; d++) {
        OF(E, 0); OF(G, 1); OF(A, 2); OF(Iy, 3); OF(Iz, 4); OF(J, 5); OF(ky, 6); OF(kz, 7); OF(L, 8); OF(shear, 9);
        for (int64_t i = 0; i < n; i++, out += 8) {
            const double half = L[i] * L[i] / 2, third = L[i] * L[i] * L[i] / 3, slide = shear[i] * L[i] / (G[i] * A[i]);
            const double by = 1 / (E[i] * Iy[i]), bz = 1 / (E[i] * Iz[i]);
            out[0] = L[i] / (E[i] * A[i]), out[1] = L[i] / (G[i] * J[i]);
            out[2] = third * bz + slide / ky[i], out[3] = half * bz, out[4] = L[i] * bz;
            out[5] = third * by + slide / kz[i], out[6] = half * by, out[7] = L[i] * by;
        }
    }
    return 0;
}

/* out (designs, n, 14) from rho, A, Iy, Iz, length, phi_y, phi_z and rotary, with polynomials (6, 6) of phi for each of
the six numbers of a plane: eq. 19. */
KERNEL int64_t mass_numbers(const double *const *given, const int64_t *steps, const double *polynomials, int64_t designs,
                            int64_t n, double *out)
{
    for (int64_t d = 0; d < designs; d++) {
        OF(rho, 0); OF(A, 1); OF(Iy, 2); OF(Iz, 3); OF(L, 4); OF(phi_y, 5); OF(phi_z, 6); OF(rotary, 7);
        for (int64_t i = 0; i < n; i++, out += 14) {
            const double line = rho[i] * L[i], unit[6] = {1, L[i], 1, L[i], L[i] * L[i], L[i] * L[i]};
            out[0] = line * A[i], out[1] = line * (Iy[i] + Iz[i]);
            for (int plane = 0; plane < 2; plane++) {
                const double phi = plane ? phi_z[i] : phi_y[i], scale = line / ((1 + phi) * (1 + phi));
                const double t = scale * A[i], r = rotary[i] * scale * (plane ? Iy[i] : Iz[i]) / (L[i] * L[i]);
                const double weights[6] = {t, t * phi, t * phi * phi, r, r * phi, r * phi * phi};
                for (int k = 0; k < 6; k++) {
                    double sum = 0;
                    for (int w = 0; w < 6; w++) sum += weights[w] * polynomials[6 * w + k];
                    out[2 + 6 * plane + k] = sum * unit[k];
                }
            }
        }
    }
    return 0;
}
