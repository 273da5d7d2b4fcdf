#include "dynamics.h"
#include "step.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MODEL (&flexura_model)
#define BYTES(count) (sizeof(double) * (size_t)(count))

struct Dynamics {
    double step;           /* the one that E and G are for; negative when for none */
    Model model;           /* A to D for the parameters as they are */
    double *values[4];     /* their entries */
    double *E, *G, *X, *d; /* exponentials, and ports */
    double *dx, *du, *dp, *dw, *dd, *work; /* changes, scratch */
};

/* One array for all numbers. */
Dynamics *flexura_dynamics(void)
{
    const int n = MODEL->states, m = MODEL->inputs, r = MODEL->ports;
    const size_t squares = (size_t)MODEL->squares, largest = (size_t)MODEL->largest;
    const size_t entries[] = {(size_t)MODEL->A.start[n], (size_t)MODEL->B.start[n],
                              (size_t)MODEL->C.start[MODEL->outputs], (size_t)MODEL->D.start[MODEL->outputs]};
    const size_t scratch = 5 * largest * largest + 2 * largest + 3 * (size_t)r + (size_t)n + (size_t)m;
    const size_t changes = (size_t)(n + m + MODEL->parameters + 2 * r);
    const size_t all = entries[0] + entries[1] + entries[2] + entries[3];
    Dynamics *own = calloc(1, sizeof(Dynamics));
    if (!own)
        return NULL;
    own->E = calloc(2 * squares + all + 2 * (size_t)r * (size_t)r + (size_t)r + changes + scratch + 1, sizeof(double));
    if (!own->E) {
        free(own);
        return NULL;
    }
    own->G = own->E + squares;
    own->values[0] = own->G + squares;
    for (int k = 1; k < 4; k++)
        own->values[k] = own->values[k - 1] + entries[k - 1];
    own->X = own->values[3] + entries[3];
    own->d = own->X + 2 * (size_t)r * (size_t)r;
    own->dx = own->d + r;
    own->du = own->dx + n;
    own->dp = own->du + m;
    own->dw = own->dp + MODEL->parameters;
    own->dd = own->dw + r;
    own->work = own->dd + r;
    own->model = *MODEL;
    own->model.A.value = own->values[0];
    own->model.B.value = own->values[1];
    own->model.C.value = own->values[2];
    own->model.D.value = own->values[3];
    return own;
}

void flexura_forget(Dynamics *own)
{
    if (own)
        free(own->E);
    free(own);
}

Fault flexura_tune(Dynamics *own, const double *p)
{
    const Rows *base[] = {&MODEL->A, &MODEL->B, &MODEL->C, &MODEL->D};
    if (!flexura_ports(MODEL, p, own->d, own->X, own->X + MODEL->ports * MODEL->ports))
        return "with these parameters the equations have no solution";
    for (int k = 0; k < 4; k++)
        flexura_tuned(MODEL, base[k], k < 2 ? MODEL->states : MODEL->outputs, k < 2 ? &MODEL->into : &MODEL->onto,
                      k % 2 ? &MODEL->of_inputs : &MODEL->of_states, k % 2 ? MODEL->inputs : MODEL->states, own->d,
                      own->X, own->values[k], own->work);
    own->step = -1.0;
    return NULL;
}

Fault flexura_look(Dynamics *own, const double *x, const double *u)
{
    (void)own, (void)x, (void)u; /* rows are worked out one by one */
    return NULL;
}

double flexura_output(const Dynamics *own, int i, const double *x, const double *u)
{
    return flexura_row(&own->model.C, i, x) + flexura_row(&own->model.D, i, u);
}

double flexura_rate(const Dynamics *own, int i, const double *x, const double *u)
{
    return flexura_row(&own->model.A, i, x) + flexura_row(&own->model.B, i, u);
}

/* Step by step of a discrete model. */
static Fault count_steps(Dynamics *own, double h, double rounding, const double *u, double *x)
{
    const double steps = floor(h / MODEL->dt + 0.5);
    if (fabs(h - steps * MODEL->dt) > 1e-6 * MODEL->dt + rounding)
        return "a communication step is a whole number of the steps that the model makes";
    for (double done = 0.0; done < steps; done += 1.0) {
        for (int i = 0; i < MODEL->states; i++)
            own->dx[i] = flexura_rate(own, i, x, u);
        memcpy(x, own->dx, BYTES(MODEL->states));
    }
    return NULL;
}

/* Steps that differ by no more than the rounding of the time at which they end are equal. */
Fault flexura_move(Dynamics *own, double h, double rounding, const double *u, double *x, double *done)
{
    *done = h;
    if (MODEL->dt > 0.0)
        return count_steps(own, h, rounding, u, x);
    if (own->step < 0.0 || fabs(h - own->step) > rounding) {
        own->step = h;
        if (!flexura_hold(&own->model, h, own->E, own->G, own->work)) {
            own->step = -1.0;
            return "over so long a step the motion grows beyond all numbers";
        }
    }
    flexura_step(&own->model, own->E, own->G, u, x, own->work);
    return NULL;
}

double flexura_indicator(int i, const double *x)
{
    (void)i, (void)x; /* there are none */
    return 1.0;
}

int flexura_is_beyond(const Dynamics *own, const double *x)
{
    (void)own, (void)x; /* it is good everywhere */
    return 0;
}

Fault flexura_change(Dynamics *own, Change *change)
{
    memset(own->dx, 0, BYTES(MODEL->states + MODEL->inputs + MODEL->parameters));
    change->x = own->dx;
    change->u = own->du;
    change->p = own->dp;
    return NULL;
}

void flexura_changed(Dynamics *own, const double *x, const double *u)
{
    for (int port = 0; port < MODEL->ports; port++)
        own->dd[port] = MODEL->slope[port] * own->dp[MODEL->parameter[port]];
    flexura_tuning(MODEL, x, u, own->d, own->X, own->dd, own->dw, own->work);
}

double flexura_output_change(const Dynamics *own, int i)
{
    return flexura_output(own, i, own->dx, own->du) + flexura_row(&MODEL->onto, i, own->dw);
}

double flexura_rate_change(const Dynamics *own, int i)
{
    return flexura_rate(own, i, own->dx, own->du) + flexura_row(&MODEL->into, i, own->dw);
}
