/* What an instance of a model is made of. */
#ifndef FLEXURA_INSTANCE_H
#define FLEXURA_INSTANCE_H

#include "clock.h"
#include "unit.h"

#include <stddef.h>

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif

#define MODEL (&flexura_sizes)
#define BYTES(count) (sizeof(double) * (size_t)(count))

typedef enum { BEFORE, RUNNING, LEFT, ENDED } Phase;

enum { INPUT, OUTPUT, STATE, DERIVATIVE, PARAMETER, GAIN, INDICATOR, TIME, NEXT, CLOCK, KINDS };

/* What makes up the state of a unit: states, inputs, parameters and gains behind it. */
typedef struct {
    double time;
    Clock clock;
    Phase phase;
    double numbers[];
} State;

struct Unit {
    unsigned int first[KINDS + 1];
    Drive drive;
    int is_tuned, is_fresh, is_warned;
    Dynamics *dynamics;
    double *u; /* inputs times their gains */
    State *state;
};

static inline double *states(const Unit *unit)
{
    return unit->state->numbers;
}

static inline double *inputs(const Unit *unit)
{
    return states(unit) + MODEL->states;
}

static inline double *parameters(const Unit *unit)
{
    return inputs(unit) + MODEL->inputs;
}

static inline double *gains(const Unit *unit)
{
    return parameters(unit) + MODEL->parameters;
}

/* Parameters and inputs as they act, and what they and the states make. */
Fault flexura_refresh(Unit *unit);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
