#include "clock.h"

#include <math.h>
#include <stddef.h>

/* How long ago the next tick was due. */
static double delay(const Clock *clock, double time, double interval)
{
    return time - (clock->start + clock->ticks * interval);
}

Fault flexura_begin_tick(Clock *clock, double time, double interval)
{
    if (!clock->is_event)
        return "a clock ticks in event mode alone";
    if (!clock->is_ticking && !(fabs(delay(clock, time, interval)) < 0.5 * interval))
        return "the clock ticks at the start and once in each interval from there: now it does not";
    clock->is_ticking = 1;
    return NULL;
}

void flexura_end_tick(Clock *clock)
{
    clock->is_ticking = 0;
    clock->ticks += 1.0;
}

Fault flexura_wait(const Clock *clock, double time, double interval)
{
    if (clock->is_event)
        return "a step is made in step mode, which event mode has to be left for";
    return delay(clock, time, interval) < 0.5 * interval ? NULL : "a tick of the clock is left out";
}

Fault flexura_leave(Clock *clock)
{
    if (clock->is_ticking)
        return "a tick ends when discrete states are updated, and event mode after it";
    clock->is_event = 0;
    return NULL;
}
