/* A plant that knows its pose: M(p) x'' + C(p) x' + K(p) x + f(p) e1 + s(p) p'^2 = B(p) u, p = x[0]. */
#ifndef FLEXURA_POSED_H
#define FLEXURA_POSED_H

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

/* Between low and high everything is a sum of `points` Chebyshev polynomials, whose coefficients stand one after another
   in `flat` (points x M, C, K with zeros in its first column, B, rows, residual, readings, swing, slopes of rows, each row by
   row), and f of twice as many. Outputs are (d/dt)^derivative (readings + rows x + residual u) + D u, x without p.
   `longest` is the longest step of the integrator, `size` what its errors of the states are measured by, beside `error`
   of the states themselves, and `speed` that of p up to which the equations are good. */
typedef struct {
    int coordinates, inputs, outputs, points;
    double low, high, slack, longest, error, speed;
    const int *derivative;
    const double *flat, *force, *D, *size;
} Posed;

extern const Posed flexura_posed;

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
