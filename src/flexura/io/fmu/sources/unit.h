/* One instance of a model, by value references, for all versions of FMI: inputs, outputs, states, their
   derivatives where time is continuous, parameters, gains of the inputs, event indicators, and time, numbered in this
   order. */
#ifndef FLEXURA_UNIT_H
#define FLEXURA_UNIT_H

#include "dynamics.h"

#include <stddef.h>

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

typedef struct Unit Unit;

/* A unit that makes its own steps, or one that a solver integrates. NULL with a fault when there can be none. */
Unit *flexura_new(const char *token, int makes_steps, Fault *fault);
void flexura_free(Unit *unit);

Fault flexura_begin(Unit *unit);                 /* initialization */
Fault flexura_at_time(Unit *unit, double time);  /* sets the time */
void flexura_run(Unit *unit);                    /* after initialization */
void flexura_end(Unit *unit);
void flexura_restart(Unit *unit);
double flexura_time(const Unit *unit);
int flexura_makes_steps(const Unit *unit);
size_t flexura_states(void);

Fault flexura_get(Unit *unit, const unsigned int *reference, size_t n, double *value);
Fault flexura_set(Unit *unit, const unsigned int *reference, size_t n, const double *value);
Fault flexura_advance(Unit *unit, double time, double h); /* by h, inputs held, or up to where it leaves */

/* What is told where the model has left what its equations are for, or NULL; a unit that has makes no more steps. */
const char *flexura_has_left(Unit *unit);
const char *flexura_caution(Unit *unit); /* what is told once, where its equations are no longer good, or NULL */
size_t flexura_indicators(void);
Fault flexura_get_indicators(Unit *unit, double *indicator, size_t n);

/* All n states, their derivatives and their ordinary sizes. */
Fault flexura_set_states(Unit *unit, const double *x, size_t n);
Fault flexura_get_states(const Unit *unit, double *x, size_t n);
Fault flexura_get_rates(Unit *unit, double *rates, size_t n);
Fault flexura_get_nominals(double *nominal, size_t n);

/* Changes of outputs and derivatives with those of inputs, states, parameters and gains. */
Fault flexura_directional(Unit *unit, const unsigned int *unknown, size_t unknowns, const unsigned int *known,
                          size_t knowns, const double *dknown, double *dunknown);

/* Copies of all that changes: kept in memory (made when *kept is NULL), and as bytes. */
Fault flexura_keep(const Unit *unit, void **kept);
Fault flexura_restore(Unit *unit, const void *kept);
size_t flexura_bytes(void);
Fault flexura_write(const void *kept, char *bytes, size_t size);
Fault flexura_read(const char *bytes, size_t size, void **kept);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
