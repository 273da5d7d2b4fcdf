/* Sizes of sections along members, by their contours, and properties of rectangles, theory eqs. 6, 7 and 22-27. */
#include "flexura.h"

#define SUM_INVERSE_ODD_FIFTH_POWERS 1.0045237627951384

static const double PI = 3.14159265358979323846;

enum { SIZE, CIRCULAR, ELLIPTICAL, PARABOLIC, HYPERBOLIC, CORNER_FILLETED, V_SHAPED, STRAIGHT };

/* r - sqrt(r^2 - x^2), and r beyond |x| = r. */
INLINE double arc_rise(double x, double radius)
{
    const double inside = fabs(x) < radius ? fabs(x) : radius;
    return radius - sqrt((radius - inside) * (radius + inside));
}

/* Thickness of a contour of one or two sizes a, b at a distance x from its middle. */
INLINE double thickness(int64_t shape, double x, double half, double a, double b, double web)
{
    switch (shape) {
    case CIRCULAR: return web + 2 * arc_rise(x, a);
    case ELLIPTICAL: return web + 2 * a * arc_rise(x / half, 1);
    case PARABOLIC: return web + 2 * a * (x / half) * (x / half);
    case HYPERBOLIC: return sqrt(web * web + 4 * a * (a + web) * (x / half) * (x / half));
    case CORNER_FILLETED: return web + 2 * arc_rise(fabs(x) > half - a ? fabs(x) - (half - a) : 0, a);
    case V_SHAPED: { /* of an angle a and a root of radius b */
        const double end = b * sin(a), beyond = fabs(x) - end;
        return web + 2 * (arc_rise(beyond > 0 ? end : x, b) + (beyond > 0 ? beyond : 0) * tan(a));
    }
    default: return web;
    }
}

/* k sizes of elements (k, designs, e) from `values` (designs, s) and lengths of members: of each (k, e) the shape, the
entries of a, b, the web and a shift (k, e, 4), -1 where there is none, and to which side it is shifted; of each element
(e) its place on its member, as a fraction, and this. `sizes` are designs, s, the step of lengths, k and e. */
KERNEL int64_t section_sizes(const double *values, const double *lengths, const int64_t *shape, const int64_t *entry,
                             const double *side, const double *fraction, const int64_t *member, const int64_t *sizes,
                             double *out)
{
    const int64_t designs = sizes[0], k = sizes[3], e = sizes[4];
    for (int64_t j = 0; j < k; j++, shape += e, entry += 4 * e, side += e)
        for (int64_t d = 0; d < designs; d++, out += e)
            for (int64_t i = 0; i < e; i++) {
                const double *own = values + d * sizes[1], L = lengths[d * sizes[2] + member[i]];
                double given[4];
                for (int l = 0; l < 4; l++) given[l] = entry[4 * i + l] < 0 ? 0 : own[entry[4 * i + l]];
                const double half = (L - fabs(given[3])) / 2, x = (fraction[i] - 0.5) * L + side[i] * given[3] / 2;
                const double near = x < -half ? -half : x > half ? half : x;
                out[i] = shape[i] == SIZE ? given[2] : thickness(shape[i], near, half, given[0], given[1], given[2]);
            }
    return 0;
}

/* A, Iy, Iz, J, ky, kz in rows of n, of widths b, thicknesses t and Poisson's ratios: eqs. 6 and 7. */
KERNEL int64_t rectangles(const double *b, const double *t, const double *nu, int64_t n, double *out)
{
    const double tenth = 192 / (PI * PI * PI * PI * PI);
    for (int64_t i = 0; i < n; i++) {
        const double A = b[i] * t[i], k = 10 * (1 + nu[i]) / (12 + 11 * nu[i]);
        const double thin = b[i] < t[i] ? b[i] : t[i], wide = b[i] < t[i] ? t[i] : b[i];
        const double q = exp(-PI * wide / thin), q2 = q * q, q3 = q2 * q, q5 = q3 * q2, q7 = q5 * q2;
        const double tail = q / (1 + q) + q3 / (1 + q3) / 243 + q5 / (1 + q5) / 3125 + q7 / (1 + q7) / 16807;
        const double series = SUM_INVERSE_ODD_FIFTH_POWERS - 2 * tail;
        out[i] = A, out[n + i] = A * t[i] * t[i] / 12, out[2 * n + i] = A * b[i] * b[i] / 12;
        out[3 * n + i] = wide * (thin * thin * thin) / 3 * (1 - tenth * thin / wide * series);
        out[4 * n + i] = out[5 * n + i] = k;
    }
    return 0;
}
