/* Steps of generalised-alpha (Chung and Hulbert 1993, J. Appl. Mech. 60, 371, eqs. 17, 25) with one matrix. */
#include "ldl.h"

/* right (n) less A x, A by rows. */
static inline void subtract(int64_t n, const int64_t *start, const int64_t *columns, const double *values,
                            const double *x, double *right)
{
    for (int64_t i = 0; i < n; i++) {
        double sum = 0.0;
        for (int64_t at = start[i]; at < start[i + 1]; at++) sum += values[at] * x[columns[at]];
        right[i] -= sum;
    }
}

/* Displacements q, velocities v and accelerations a (count, n), of which the first rows are given, under loads B u, B (n, m)
and u (count, m). M, C and K are by rows; the matrix of a step has factors whose rows and columns are times `scale` (n).
`work` has 6 n numbers. */
KERNEL int64_t alpha_steps(int64_t n, int64_t m, int64_t count, const int64_t *M_start, const int64_t *M_columns,
                           const double *M, const int64_t *C_start, const int64_t *C_columns, const double *C,
                           const int64_t *K_start, const int64_t *K_columns, const double *K, const double *B,
                           const double *u, const int64_t *order, const int64_t *first, const int64_t *below,
                           const double *L, const double *D, const double *scale, double dt, double am, double af,
                           double gamma, double beta, double *q, double *v, double *a, double *work)
{
    double *qm = work, *vm = qm + n, *held = vm + n, *right = held + n, *solved = right + n, *y = solved + n;
    for (int64_t k = 0; k + 1 < count; k++, q += n, v += n, a += n, u += m) {
        for (int64_t i = 0; i < n; i++) {
            q[n + i] = q[i] + dt * v[i] + (0.5 - beta) * dt * dt * a[i];
            v[n + i] = v[i] + (1 - gamma) * dt * a[i];
            qm[i] = (1 - af) * q[n + i] + af * q[i];
            vm[i] = (1 - af) * v[n + i] + af * v[i];
            held[i] = am * a[i];
            right[i] = 0.0;
            for (int64_t j = 0; j < m; j++) right[i] += B[i * m + j] * ((1 - af) * u[m + j] + af * u[j]);
        }
        subtract(n, M_start, M_columns, M, held, right);
        subtract(n, C_start, C_columns, C, vm, right);
        subtract(n, K_start, K_columns, K, qm, right);
        for (int64_t i = 0; i < n; i++) right[i] *= scale[i];
        ldl_solution(n, 1, order, first, below, L, D, right, solved, y);
        for (int64_t i = 0; i < n; i++) {
            a[n + i] = scale[i] * solved[i];
            q[n + i] += beta * dt * dt * a[n + i];
            v[n + i] += gamma * dt * a[n + i];
        }
    }
    return 0;
}
