/* The clock of a model in steps, which ticks in event mode alone: tick k, from 0 on, is due at start + k interval. */
#ifndef FLEXURA_CLOCK_H
#define FLEXURA_CLOCK_H

#include "dynamics.h"

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

typedef struct {
    double start, ticks; /* those that are over */
    int is_event, is_ticking;
} Clock;

/* Ticks come no more than half an interval early or late, so that none is left out and none comes twice. */
Fault flexura_begin_tick(Clock *clock, double time, double interval);
void flexura_end_tick(Clock *clock);
Fault flexura_wait(const Clock *clock, double time, double interval); /* up to a time */
Fault flexura_leave(Clock *clock);                                    /* event mode */

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
