/* One instance of a model, by value references, for all versions of FMI: inputs, outputs, states, their
   derivatives where time is continuous, parameters, gains of the inputs, event indicators, time, and of a model in steps
   its next states and its clock, numbered in this order. */
#ifndef FLEXURA_UNIT_H
#define FLEXURA_UNIT_H

#include "dynamics.h"

#include <stddef.h>

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

typedef struct Unit Unit;

/* What makes a unit move: a solver that integrates it, steps of its own, or a clock, with one step at each tick. */
typedef enum { BY_SOLVER, BY_STEPS, BY_CLOCK } Drive;

Unit *flexura_new(const char *token, Drive drive, Fault *fault); /* NULL with a fault when there can be none */
void flexura_free(Unit *unit);

Fault flexura_begin(Unit *unit);                 /* initialization */
Fault flexura_at_time(Unit *unit, double time);  /* sets the time */
void flexura_run(Unit *unit);                    /* after initialization */
void flexura_end(Unit *unit);
void flexura_restart(Unit *unit);
double flexura_time(const Unit *unit);
size_t flexura_states(void); /* those that are continuous */

Fault flexura_get(Unit *unit, const unsigned int *reference, size_t n, double *value);
Fault flexura_set(Unit *unit, const unsigned int *reference, size_t n, const double *value);
Fault flexura_advance(Unit *unit, double time, double h); /* by h, inputs held, or up to where it leaves */

/* Event mode, in which the clock ticks: inputs and outputs have values, and a step is made when the tick ends. */
Fault flexura_enter_event(Unit *unit);
Fault flexura_leave_event(Unit *unit);
Fault flexura_set_clock(Unit *unit, int is_active);
int flexura_is_ticking(const Unit *unit);
Fault flexura_update(Unit *unit); /* ends an instant */
Fault flexura_find_clocks(const Unit *unit, const unsigned int *reference, size_t n);
double flexura_interval(void); /* of the clock; 0 without one */

/* What is told where the model has left what its equations are for, or NULL; a unit that has makes no more steps. */
const char *flexura_has_left(Unit *unit);
const char *flexura_caution(Unit *unit); /* what is told once, where its equations are no longer good, or NULL */
size_t flexura_indicators(void);
Fault flexura_get_indicators(Unit *unit, double *indicator, size_t n);

/* All n continuous states, their derivatives and their ordinary sizes. */
Fault flexura_set_states(Unit *unit, const double *x, size_t n);
Fault flexura_get_states(const Unit *unit, double *x, size_t n);
Fault flexura_get_rates(Unit *unit, double *rates, size_t n);
Fault flexura_get_nominals(double *nominal, size_t n);

/* Changes of outputs, derivatives and next states with those of inputs, states, parameters and gains. */
Fault flexura_directional(Unit *unit, const unsigned int *unknown, size_t unknowns, const unsigned int *known,
                          size_t knowns, const double *dknown, double *dunknown);

/* Copies of all that changes: kept in memory (made when *kept is NULL), and as bytes. */
Fault flexura_keep(const Unit *unit, void **kept);
Fault flexura_restore(Unit *unit, const void *kept);
void flexura_drop(void **kept);
size_t flexura_bytes(void);
Fault flexura_write(const void *kept, char *bytes, size_t size);
Fault flexura_read(const char *bytes, size_t size, void **kept);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
