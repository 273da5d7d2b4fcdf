#include "posed.h"
#include "dynamics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PLANT (&flexura_posed)
#define BYTES(count) (sizeof(double) * (size_t)(count))
#define STAGES 7

/* Dormand and Prince 1980: stages, of which the last is the step of order 5, and its difference from that of order 4. */
static const double STAGE[STAGES][STAGES - 1] = {
    {0.0},
    {1.0 / 5.0},
    {3.0 / 40.0, 9.0 / 40.0},
    {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
    {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
    {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
    {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0},
};
static const double OFF[STAGES] = {71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                                   -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};

struct Dynamics {
    int all;      /* numbers of a pose */
    double speed; /* the largest of p within the last step */
    double *flat, *T, *L, *rate, *stage, *next, *output;
    const double *M, *C, *K, *B, *rows, *residual, *readings, *swing, *slopes;
};

Dynamics *flexura_dynamics(void)
{
    const int r = PLANT->coordinates, m = PLANT->inputs, p = PLANT->outputs;
    Dynamics *own = calloc(1, sizeof(Dynamics));
    if (!own)
        return NULL;
    own->all = r * (3 * r + m + 2 * p + 1) + p * (m + 1);
    own->flat = calloc((size_t)(own->all + 2 * PLANT->points + r * r + 2 * r * (STAGES + 2) + p), sizeof(double));
    if (!own->flat) {
        free(own);
        return NULL;
    }
    own->M = own->flat;
    own->C = own->M + r * r;
    own->K = own->C + r * r;
    own->B = own->K + r * r;
    own->rows = own->B + r * m;
    own->residual = own->rows + p * r;
    own->readings = own->residual + p * m;
    own->swing = own->readings + p;
    own->slopes = own->swing + r;
    own->T = own->flat + own->all;
    own->L = own->T + 2 * PLANT->points;
    own->rate = own->L + r * r;
    own->stage = own->rate + 2 * r;
    own->next = own->stage + 2 * r * STAGES;
    own->output = own->next + 2 * r;
    return own;
}

void flexura_forget(Dynamics *own)
{
    if (own)
        free(own->flat);
    free(own);
}

Fault flexura_tune(Dynamics *own, const double *p)
{
    (void)own, (void)p; /* there are no parameters */
    return NULL;
}

static double dot(int n, const double *left, const double *right)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += left[i] * right[i];
    return sum;
}

/* Everything at p, or at the end that it is beyond. Returns the force that holds it there. */
static double at_pose(Dynamics *own, double p)
{
    const double place = fmin(fmax((2.0 * p - PLANT->low - PLANT->high) / (PLANT->high - PLANT->low), -1.0), 1.0);
    const int count = 2 * PLANT->points;
    own->T[0] = 1.0;
    own->T[1] = place;
    for (int k = 2; k < count; k++)
        own->T[k] = 2.0 * place * own->T[k - 1] - own->T[k - 2];
    memset(own->flat, 0, BYTES(own->all));
    for (int k = 0; k < PLANT->points; k++)
        for (int i = 0; i < own->all; i++)
            own->flat[i] += own->T[k] * PLANT->flat[k * own->all + i];
    return dot(count, own->T, PLANT->force);
}

/* a = M^-1 a by the factors of Cholesky; 0 where M has none. */
static int solve(int r, const double *M, double *L, double *a)
{
    for (int i = 0; i < r; i++)
        for (int j = 0; j <= i; j++) {
            const double rest = M[i * r + j] - dot(j, L + i * r, L + j * r);
            if (i == j && !(rest > 0.0))
                return 0;
            L[i * r + j] = i == j ? sqrt(rest) : rest / L[j * r + j];
        }
    for (int i = 0; i < r; i++)
        a[i] = (a[i] - dot(i, L + i * r, a)) / L[i * r + i];
    for (int i = r - 1; i >= 0; i--) {
        for (int j = i + 1; j < r; j++)
            a[i] -= L[j * r + i] * a[j];
        a[i] /= L[i * r + i];
    }
    return 1;
}

/* Rates of z = (x, v), and what the pose is there. */
static int rates(Dynamics *own, const double *z, const double *u, double *rate)
{
    const int r = PLANT->coordinates;
    const double *v = z + r, force = at_pose(own, z[0]);
    memcpy(rate, v, BYTES(r));
    for (int i = 0; i < r; i++)
        rate[r + i] = dot(PLANT->inputs, own->B + i * PLANT->inputs, u) - dot(r, own->C + i * r, v) -
                      dot(r, own->K + i * r, z) - own->swing[i] * v[0] * v[0];
    rate[r] -= force;
    return solve(r, own->M, own->L, rate + r);
}

static const char SINGULAR[] = "at this pose the mass matrix is not positive";

Fault flexura_look(Dynamics *own, const double *x, const double *u)
{
    const int r = PLANT->coordinates, m = PLANT->inputs;
    const double *v = x + r;
    if (!rates(own, x, u, own->rate))
        return SINGULAR;
    for (int i = 0; i < PLANT->outputs; i++) {
        const double *row = own->rows + i * r;
        double sum = dot(m, PLANT->D + i * m, u);
        if (PLANT->derivative[i] == 0)
            sum += own->readings[i] + dot(r - 1, row + 1, x + 1) + dot(m, own->residual + i * m, u);
        else if (PLANT->derivative[i] == 1)
            sum += dot(r, row, v);
        else
            sum += dot(r, row, own->rate + r) + dot(r, own->slopes + i * r, v) * v[0];
        own->output[i] = sum;
    }
    return NULL;
}

double flexura_output(const Dynamics *own, int i, const double *x, const double *u)
{
    (void)x, (void)u;
    return own->output[i];
}

double flexura_rate(const Dynamics *own, int i, const double *x, const double *u)
{
    (void)x, (void)u;
    return own->rate[i];
}

double flexura_indicator(int i, const double *x)
{
    return (i == 0 ? x[0] - PLANT->low : PLANT->high - x[0]) + PLANT->slack;
}

int flexura_is_beyond(const Dynamics *own, const double *x)
{
    return own->speed > PLANT->speed || fabs(x[PLANT->coordinates]) > PLANT->speed;
}

static int is_outside(const double *x)
{
    return !(flexura_indicator(0, x) > 0.5 * PLANT->slack && flexura_indicator(1, x) > 0.5 * PLANT->slack);
}

/* A step by h from x, whose rates are those of the first stage, to `next`; returns its error over what is allowed, negative where there is no such step. */
static double attempt(Dynamics *own, double h, const double *u, const double *x)
{
    const int n = 2 * PLANT->coordinates;
    double worst = 0.0;
    for (int k = 1; k < STAGES; k++) {
        memcpy(own->next, x, BYTES(n));
        for (int j = 0; j < k; j++)
            for (int i = 0; i < n; i++)
                own->next[i] += h * STAGE[k][j] * own->stage[j * n + i];
        if (!rates(own, own->next, u, own->stage + k * n))
            return -1.0;
    }
    for (int i = 0; i < n; i++) {
        double off = 0.0;
        for (int k = 0; k < STAGES; k++)
            off += h * OFF[k] * own->stage[k * n + i];
        off = fabs(off) / (PLANT->size[i] + PLANT->error * fmax(fabs(x[i]), fabs(own->next[i])));
        if (!(off <= worst))
            worst = off;
    }
    return worst;
}

/* Steps within the step, never longer than `longest`; one that would leave the stroke is halved until it is there. */
Fault flexura_move(Dynamics *own, double h, double rounding, const double *u, double *x, double *done)
{
    double step = fmin(h, PLANT->longest);
    int leaves = 0;
    *done = own->speed = 0.0;
    (void)rounding;
    if (is_outside(x))
        return NULL;
    if (!rates(own, x, u, own->stage))
        return SINGULAR;
    while (*done < h && !(leaves && step <= 1e-9 * PLANT->longest)) {
        const double rest = h - *done, own_step = fmin(step, rest);
        const double error = attempt(own, own_step, u, x);
        if (error < 0.0)
            return SINGULAR;
        if (!(error <= 1.0)) {
            step = own_step * (isfinite(error) ? fmax(0.9 * pow(error, -0.2), 0.2) : 0.2);
            if (!(step > 1e-9 * PLANT->longest))
                return "the motion cannot be followed: it changes too fast";
        } else if (is_outside(own->next)) {
            leaves = 1;
            step = 0.5 * own_step;
        } else {
            memcpy(x, own->next, BYTES(2 * PLANT->coordinates));
            memcpy(own->stage, own->stage + 2 * PLANT->coordinates * (STAGES - 1), BYTES(2 * PLANT->coordinates));
            own->speed = fmax(own->speed, fabs(x[PLANT->coordinates]));
            *done = own_step < rest ? *done + own_step : h;
            if (!leaves)
                step = fmin(own_step * fmin(0.9 * pow(fmax(error, 1e-10), -0.2), 5.0), PLANT->longest);
        }
    }
    return NULL;
}

Fault flexura_change(Dynamics *own, Change *change)
{
    (void)own, (void)change;
    return "directional derivatives are not provided";
}

void flexura_changed(Dynamics *own, const double *x, const double *u)
{
    (void)own, (void)x, (void)u;
}

double flexura_output_change(const Dynamics *own, int i)
{
    (void)own, (void)i;
    return 0.0;
}

double flexura_rate_change(const Dynamics *own, int i)
{
    (void)own, (void)i;
    return 0.0;
}
