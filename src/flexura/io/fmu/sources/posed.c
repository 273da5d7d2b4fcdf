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

/* Everything of a pose, or its slopes by p: one array, and where its parts begin. */
typedef struct {
    double *flat, force; /* what holds it there */
    const double *M, *C, *K, *B, *rows, *residual, *readings, *swing, *slopes;
} Pose;

/* What a pose is linear in: coordinates, their rates and accelerations, rates times that of p, inputs, and 1. */
typedef struct {
    const double *x, *v, *a, *w, *u;
    double one;
} Motion;

struct Dynamics {
    int all;      /* numbers of a pose */
    double speed; /* the largest of p within the last step */
    Pose at, by;  /* p as it is, and slopes there */
    double *T, *L, *rate, *w, *stage, *next, *output;
    double *dx, *du, *drate, *dw, *doutput; /* changes */
};

static void lay_out(Pose *pose, double *flat)
{
    const int r = PLANT->coordinates, m = PLANT->inputs, p = PLANT->outputs;
    pose->flat = flat;
    pose->M = flat;
    pose->C = pose->M + r * r;
    pose->K = pose->C + r * r;
    pose->B = pose->K + r * r;
    pose->rows = pose->B + r * m;
    pose->residual = pose->rows + p * r;
    pose->readings = pose->residual + p * m;
    pose->swing = pose->readings + p;
    pose->slopes = pose->swing + r;
}

Dynamics *flexura_dynamics(void)
{
    const int r = PLANT->coordinates, m = PLANT->inputs, p = PLANT->outputs;
    const int all = r * (3 * r + m + 2 * p + 1) + p * (m + 1);
    const int steps = r * r + r * (2 * STAGES + 5) + p, changes = 5 * r + m + p;
    Dynamics *own = calloc(1, sizeof(Dynamics));
    double *numbers = calloc((size_t)(2 * all + 4 * PLANT->points + steps + changes), sizeof(double));
    if (!own || !numbers) {
        free(own);
        free(numbers);
        return NULL;
    }
    own->all = all;
    lay_out(&own->at, numbers);
    lay_out(&own->by, own->at.flat + all);
    own->T = own->by.flat + all;
    own->L = own->T + 4 * PLANT->points;
    own->rate = own->L + r * r;
    own->w = own->rate + 2 * r;
    own->stage = own->w + r;
    own->next = own->stage + 2 * r * STAGES;
    own->output = own->next + 2 * r;
    own->dx = own->output + p;
    own->du = own->dx + 2 * r;
    own->drate = own->du + m;
    own->dw = own->drate + 2 * r;
    own->doutput = own->dw + r;
    return own;
}

void flexura_forget(Dynamics *own)
{
    if (own)
        free(own->at.flat);
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

/* The sum of polynomials whose values, or slopes, are T. */
static void add_up(int all, const double *T, Pose *pose)
{
    memset(pose->flat, 0, BYTES(all));
    for (int k = 0; k < PLANT->points; k++)
        for (int i = 0; i < all; i++)
            pose->flat[i] += T[k] * PLANT->flat[k * all + i];
    pose->force = dot(2 * PLANT->points, T, PLANT->force);
}

/* Everything at p, or at the end that it is beyond. */
static void at_pose(Dynamics *own, double p)
{
    const double place = fmin(fmax((2.0 * p - PLANT->low - PLANT->high) / (PLANT->high - PLANT->low), -1.0), 1.0);
    own->T[0] = 1.0;
    own->T[1] = place;
    for (int k = 2; k < 2 * PLANT->points; k++)
        own->T[k] = 2.0 * place * own->T[k - 1] - own->T[k - 2];
    add_up(own->all, own->T, &own->at);
}

/* Slopes of what is known at p: beyond an end there are none. */
static void slopes_at_pose(Dynamics *own, double p)
{
    const double *T = own->T;
    double *slope = own->T + 2 * PLANT->points;
    slope[0] = 0.0;
    slope[1] = p < PLANT->low || p > PLANT->high ? 0.0 : 2.0 / (PLANT->high - PLANT->low);
    for (int k = 2; k < 2 * PLANT->points; k++)
        slope[k] = 2.0 * (slope[1] * T[k - 1] + T[1] * slope[k - 1]) - slope[k - 2];
    add_up(own->all, slope, &own->by);
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

/* Adds `factor` times B u - C v - K x - s w - f: what moves a coordinate. */
static void add_forces(const Pose *pose, const Motion *of, double factor, double *forces)
{
    const int r = PLANT->coordinates, m = PLANT->inputs;
    for (int i = 0; i < r; i++)
        forces[i] += factor * (dot(m, pose->B + i * m, of->u) - dot(r, pose->C + i * r, of->v) -
                               dot(r, pose->K + i * r, of->x) - pose->swing[i] * of->w[0]);
    forces[0] -= factor * pose->force * of->one;
}

/* What an output reads, but for D u. */
static double reading(const Pose *pose, int i, const Motion *of)
{
    const int r = PLANT->coordinates, m = PLANT->inputs;
    const double *row = pose->rows + i * r;
    if (PLANT->derivative[i] == 0)
        return pose->readings[i] * of->one + dot(r - 1, row + 1, of->x + 1) + dot(m, pose->residual + i * m, of->u);
    if (PLANT->derivative[i] == 1)
        return dot(r, row, of->v);
    return dot(r, row, of->a) + dot(r, pose->slopes + i * r, of->w);
}

/* The motion at z = (x, v), whose accelerations are those of `rate`. */
static Motion motion_at(Dynamics *own, const double *z, const double *u, const double *rate)
{
    const int r = PLANT->coordinates;
    const Motion motion = {z, z + r, rate + r, own->w, u, 1.0};
    for (int i = 0; i < r; i++)
        own->w[i] = motion.v[i] * motion.v[0];
    return motion;
}

/* Rates of z, and what the pose is there. */
static int rates(Dynamics *own, const double *z, const double *u, double *rate)
{
    const int r = PLANT->coordinates;
    const Motion motion = motion_at(own, z, u, rate);
    at_pose(own, z[0]);
    memcpy(rate, motion.v, BYTES(r));
    memset(rate + r, 0, BYTES(r));
    add_forces(&own->at, &motion, 1.0, rate + r);
    return solve(r, own->at.M, own->L, rate + r);
}

static const char SINGULAR[] = "at this pose the mass matrix is not positive";

Fault flexura_look(Dynamics *own, const double *x, const double *u)
{
    const int m = PLANT->inputs;
    if (!rates(own, x, u, own->rate))
        return SINGULAR;
    const Motion motion = motion_at(own, x, u, own->rate);
    for (int i = 0; i < PLANT->outputs; i++)
        own->output[i] = reading(&own->at, i, &motion) + dot(m, PLANT->D + i * m, u);
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
    memset(own->dx, 0, BYTES(2 * PLANT->coordinates + PLANT->inputs));
    change->x = own->dx;
    change->u = own->du;
    return NULL;
}

/* By the product rule, of everything that was looked at: what is linear in pose and motion changes with either, and
   M da = dF - dM a. */
void flexura_changed(Dynamics *own, const double *x, const double *u)
{
    const int r = PLANT->coordinates, m = PLANT->inputs;
    const double *v = x + r, *dv = own->dx + r, dp = own->dx[0];
    const Motion motion = motion_at(own, x, u, own->rate);
    const Motion change = {own->dx, dv, own->drate + r, own->dw, own->du, 0.0};
    slopes_at_pose(own, x[0]);
    for (int i = 0; i < r; i++)
        own->dw[i] = dv[i] * v[0] + v[i] * dv[0];
    memcpy(own->drate, dv, BYTES(r));
    for (int i = 0; i < r; i++)
        own->drate[r + i] = -dp * dot(r, own->by.M + i * r, motion.a);
    add_forces(&own->by, &motion, dp, own->drate + r);
    add_forces(&own->at, &change, 1.0, own->drate + r);
    (void)solve(r, own->at.M, own->L, own->drate + r); /* as it did for the rates */
    for (int i = 0; i < PLANT->outputs; i++)
        own->doutput[i] = dp * reading(&own->by, i, &motion) + reading(&own->at, i, &change) +
                          dot(m, PLANT->D + i * m, own->du);
}

double flexura_output_change(const Dynamics *own, int i)
{
    return own->doutput[i];
}

double flexura_rate_change(const Dynamics *own, int i)
{
    return own->drate[i];
}
