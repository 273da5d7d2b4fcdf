/* Poses and twists, four at a time: rotations, and the logarithm of SE(3) with its derivatives, as motion/se3.py.

Vectors are of three `four`, matrices of nine, row by row. */
#ifndef SE3_H
#define SE3_H

#include "flexura.h"

enum { TERMS = 32 }; /* of the series, of which the largest angle takes all */

#define ZERO_ANGLE 1e-150
#define RATIO 39.47841760435743 /* (2 pi)^2 */

/* a matrix of 6 x 6 as blocks of 3 x 3: upper left, upper right, lower left, lower right */
typedef four six[4][9];

INLINE four root(four a)
{
    four out;
    for (int l = 0; l < 4; l++) out[l] = sqrt(a[l]);
    return out;
}

INLINE double largest(four a)
{
    double one = a[0] > a[1] ? a[0] : a[1], other = a[2] > a[3] ? a[2] : a[3];
    return one > other ? one : other;
}

INLINE four dot(const four *a, const four *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out += factor a x b */
INLINE void add_cross(four *out, double factor, const four *a, const four *b)
{
    four x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] += factor * x, out[1] += factor * y, out[2] += factor * z;
}

/* A v */
INLINE void turned(four *out, const four *A, const four *v)
{
    for (int i = 0; i < 3; i++) out[i] = dot(A + 3 * i, v);
}

/* A' v */
INLINE void turned_back(four *out, const four *A, const four *v)
{
    for (int i = 0; i < 3; i++) out[i] = A[i] * v[0] + A[3 + i] * v[1] + A[6 + i] * v[2];
}

/* A B */
INLINE void product(four *out, const four *A, const four *B)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* A B' */
INLINE void product_of_back(four *out, const four *A, const four *B)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[3 * i + j] = dot(A + 3 * i, B + 3 * j);
}

/* A' B */
INLINE void product_back(four *out, const four *A, const four *B)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
}

/* out += skew(v) A */
INLINE void add_skew_left(four *out, double factor, const four *v, const four *A)
{
    for (int j = 0; j < 3; j++) {
        four a = A[j], b = A[3 + j], c = A[6 + j];
        out[j] += factor * (v[1] * c - v[2] * b);
        out[3 + j] += factor * (v[2] * a - v[0] * c);
        out[6 + j] += factor * (v[0] * b - v[1] * a);
    }
}

/* out += A skew(v): each row gets row x v */
INLINE void add_skew_right(four *out, double factor, const four *A, const four *v)
{
    for (int i = 0; i < 3; i++) add_cross(out + 3 * i, factor, A + 3 * i, v);
}

/* out += factor skew(v) */
INLINE void add_skew(four *out, double factor, const four *v)
{
    out[1] -= factor * v[2], out[2] += factor * v[1];
    out[3] += factor * v[2], out[5] -= factor * v[0];
    out[6] -= factor * v[1], out[7] += factor * v[0];
}

/* The rotation exp(skew w) by Rodrigues: 1 + a skew w + b (w w' - w'w). */
INLINE void rotation(four *R, const four *w)
{
    four square = dot(w, w), half = 0.5 * root(square), sinc, cosine;
    for (int l = 0; l < 4; l++) {
        sinc[l] = half[l] > 0 ? sin(half[l]) / half[l] : 1.0;
        cosine[l] = cos(half[l]);
    }
    four a = sinc * cosine, b = 0.5 * sinc * sinc;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) R[3 * i + j] = b * w[i] * w[j] + (i == j ? 1.0 - b * square : (four){0});
    four aw[3] = {a * w[0], a * w[1], a * w[2]};
    add_skew(R, 1.0, aw);
}

/* The rotation vector of a rotation by less than half a turn. */
INLINE void rotation_vector(four *w, const four *R)
{
    w[0] = 0.5 * (R[7] - R[5]), w[1] = 0.5 * (R[2] - R[6]), w[2] = 0.5 * (R[3] - R[1]);
    four sine = root(dot(w, w)), cosine = 0.5 * (R[0] + R[4] + R[8]) - 0.5, over;
    for (int l = 0; l < 4; l++) {
        double angle = atan2(sine[l], cosine[l]);
        over[l] = (angle > ZERO_ANGLE ? angle : ZERO_ANGLE) / (sine[l] > ZERO_ANGLE ? sine[l] : ZERO_ANGLE);
    }
    for (int i = 0; i < 3; i++) w[i] *= over;
}

/* The logarithm e = (v, w) of relative poses. Of after and before = even + ad/2 and even - ad/2 (theory eq. G4) the even
part is [[D, U], [0, D]], both symmetric, as A^2 and A^4 have w w' and v w' + w v' in them and nothing else:
D = 1 + c (w w' - w'w), U = c (v w' + w v') - 2 c4 v'w w w' - (2 c2 - 4 c4 w'w) v'w, c = c2 - c4 w'w. */
typedef struct {
    four e[6], square, along, c, own, ww, more;
    four slope[4]; /* c2, c4 and their derivatives by -w'w */
} logarithm;

/* Of poses R, x; derivatives of c2 and c4 where `second` is asked for after. `series` (32, 4) holds the coefficients. */
INLINE void take_logarithm(logarithm *out, const four *R, const four *x, const double *series, int second)
{
    four *v = out->e, *w = out->e + 3, across[3] = {0}, twice[3] = {0};
    rotation_vector(w, R);
    four square = out->square = dot(w, w), y = -square;
    double most = largest(square);
    int64_t terms = most < 1e-6 ? 4 : 3 + (int64_t)ceil(40 / log(RATIO / most));
    terms = terms < TERMS ? terms : TERMS;
    for (int i = 0; i < (second ? 4 : 2); i++) {
        four sum = {0};
        for (int64_t k = terms; k-- > 0;) sum = sum * y + series[4 * k + i];
        out->slope[i] = sum;
    }
    four c2 = out->slope[0], c4 = out->slope[1], c = out->c = c2 - c4 * square;
    add_cross(across, 1.0, w, x);
    add_cross(twice, 1.0, w, across);
    for (int i = 0; i < 3; i++) v[i] = x[i] - 0.5 * across[i] + c * twice[i];
    out->along = dot(v, w);
    out->own = 1.0 - c * square;
    out->ww = -2.0 * c4 * out->along;
    out->more = (4.0 * c4 * square - 2.0 * c2) * out->along;
}

/* after h, or before h for a `side` of -1 */
INLINE void log_times(four *out, const logarithm *log, double side, const four *h)
{
    const four *v = log->e, *w = log->e + 3;
    four wh = dot(w, h), ww = dot(w, h + 3), vw = dot(v, h + 3);
    for (int i = 0; i < 3; i++) {
        four U = log->c * (v[i] * ww + w[i] * vw) + log->ww * w[i] * ww + log->more * h[3 + i];
        out[i] = log->own * h[i] + log->c * w[i] * wh + U;
        out[3 + i] = log->own * h[3 + i] + log->c * w[i] * ww;
    }
    add_cross(out, 0.5 * side, w, h);
    add_cross(out, 0.5 * side, v, h + 3);
    add_cross(out + 3, 0.5 * side, w, h + 3);
}

/* after' n, or before' n for a `side` of -1 */
INLINE void log_back_times(four *out, const logarithm *log, double side, const four *n)
{
    const four *v = log->e, *w = log->e + 3;
    four wf = dot(w, n), vf = dot(v, n), wm = dot(w, n + 3);
    for (int i = 0; i < 3; i++) {
        four U = log->c * (v[i] * wf + w[i] * vf) + log->ww * w[i] * wf + log->more * n[i];
        out[i] = log->own * n[i] + log->c * w[i] * wf;
        out[3 + i] = log->own * n[3 + i] + log->c * w[i] * wm + U;
    }
    add_cross(out, -0.5 * side, w, n);
    add_cross(out + 3, -0.5 * side, v, n);
    add_cross(out + 3, -0.5 * side, w, n + 3);
}

/* The blocks D and U (9) of after, or of before for a `side` of -1. */
INLINE void log_blocks(four *D, four *U, const logarithm *log, double side)
{
    const four *v = log->e, *w = log->e + 3;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            four ww = w[i] * w[j];
            D[3 * i + j] = log->c * ww + (i == j ? log->own : (four){0});
            U[3 * i + j] = log->c * (v[i] * w[j] + w[i] * v[j]) + log->ww * ww + (i == j ? log->more : (four){0});
        }
    add_skew(D, 0.5 * side, w);
    add_skew(U, 0.5 * side, v);
}

/* B and C (9) of co_ad(n) = [[0, B], [B, C]], ad(d)' n = co_ad(n) d, from n (6) */
INLINE void co_ad(four *B, four *C, const four *n)
{
    memset(B, 0, 9 * sizeof *B);
    memset(C, 0, 9 * sizeof *C);
    add_skew(B, 1.0, n);
    add_skew(C, 1.0, n + 3);
}

/* ad' n */
INLINE void ad_back(four *out, const four *e, const four *n)
{
    memset(out, 0, 6 * sizeof *out);
    add_cross(out, -1.0, e + 3, n);
    add_cross(out + 3, -1.0, e, n);
    add_cross(out + 3, -1.0, e + 3, n + 3);
}

/* ad' [[0, B], [B, C]] added to a matrix of the same form */
INLINE void add_ad_back(four *outB, four *outC, const four *e, const four *B, const four *C)
{
    add_skew_left(outB, -1.0, e + 3, B);
    add_skew_left(outC, -1.0, e, B);
    add_skew_left(outC, -1.0, e + 3, C);
}

/* Derivatives by e of before' n and after' n, n fixed (theory eq. G6). */
INLINE void log_second(six before, six after, const logarithm *log, const four *n)
{
    four n1[6], n2[6], n3[6], n4[6], B0[9], C0[9], B[9], C[9], evenB[9], evenC[9], lastB[9], lastC[9], onceB[9], onceC[9];
    const four *e = log->e, *slope = log->slope;
    ad_back(n1, e, n);
    ad_back(n2, e, n1);
    ad_back(n3, e, n2);
    ad_back(n4, e, n3);
    co_ad(B0, C0, n);
    co_ad(B, C, n1);
    add_ad_back(B, C, e, B0, C0); /* first = ad' m0 + m1 */
    for (int i = 0; i < 9; i++) evenB[i] = slope[0] * B[i], evenC[i] = slope[0] * C[i];
    co_ad(onceB, onceC, n2); /* ad'^2 first + ad' m2 + m3 = ad' (ad' first + m2) + m3 */
    add_ad_back(onceB, onceC, e, B, C);
    co_ad(lastB, lastC, n3);
    add_ad_back(lastB, lastC, e, onceB, onceC);
    for (int i = 0; i < 9; i++) evenB[i] += slope[1] * lastB[i], evenC[i] += slope[1] * lastC[i];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int own = 3 * i + j;
            four w = e[3 + j], up = -2.0 * (slope[2] * n2[i] + slope[3] * n4[i]) * w;
            four down = -2.0 * (slope[2] * n2[3 + i] + slope[3] * n4[3 + i]) * w;
            four half[4] = {{0}, 0.5 * B0[own], 0.5 * B0[own], 0.5 * C0[own]};
            four even[4] = {{0}, evenB[own] + up, evenB[own], evenC[own] + down};
            for (int b = 0; b < 4; b++) before[b][own] = even[b] - half[b], after[b][own] = even[b] + half[b];
        }
}

#endif
