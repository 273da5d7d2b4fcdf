/* The equations that a unit is of: x' = f(x, u, p), y = g(x, u, p), with inputs u that are held over steps. */
#ifndef FLEXURA_DYNAMICS_H
#define FLEXURA_DYNAMICS_H

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

typedef const char *Fault; /* what is wrong, or NULL */

/* With dt > 0 a model goes in steps. `initial` are states at first, NULL for zeros, `nominal` their ordinary sizes,
   `start` parameters at first. Where an indicator is below `slack` / 2, x has left what the equations are for, of which
   `left` tells, and `caution` where it is beyond what they are good for. */
typedef struct {
    int states, inputs, outputs, parameters, indicators;
    double dt, slack;
    const double *initial, *nominal, *start;
    const char *left, *caution;
} Sizes;

extern const Sizes flexura_sizes;

typedef struct Dynamics Dynamics;

Dynamics *flexura_dynamics(void); /* NULL without memory */
void flexura_forget(Dynamics *own);

/* Parameters as they are now. */
Fault flexura_tune(Dynamics *own, const double *p);

/* Makes outputs and rates those of x and u. */
Fault flexura_look(Dynamics *own, const double *x, const double *u);
double flexura_output(const Dynamics *own, int i, const double *x, const double *u);
double flexura_rate(const Dynamics *own, int i, const double *x, const double *u);

/* A step by h, which is known to `rounding`; *done is how far it came, less than h where x leaves. */
Fault flexura_move(Dynamics *own, double h, double rounding, const double *u, double *x, double *done);
double flexura_indicator(int i, const double *x);
int flexura_is_beyond(const Dynamics *own, const double *x); /* or was within the last step */

/* Where changes of what is known are to be written, zeros at first, and what they make of outputs and rates. */
typedef struct {
    double *x, *u, *p;
} Change;

Fault flexura_change(Dynamics *own, Change *change);
void flexura_changed(Dynamics *own, const double *x, const double *u);
double flexura_output_change(const Dynamics *own, int i);
double flexura_rate_change(const Dynamics *own, int i);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
