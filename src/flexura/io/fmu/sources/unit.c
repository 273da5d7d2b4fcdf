#include "instance.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#define TOKEN_BYTES sizeof(MODEL_TOKEN)

/* Where value references of a kind begin: the next after those of the kind before. */
static void count_references(unsigned int *first)
{
    const int is_discrete = MODEL->dt > 0.0, rates = is_discrete ? 0 : MODEL->states;
    const int sizes[KINDS] = {MODEL->inputs, MODEL->outputs,    MODEL->states, rates,                 MODEL->parameters,
                              MODEL->inputs, MODEL->indicators, 1,             MODEL->states - rates, is_discrete};
    for (int kind = 0; kind < KINDS; kind++)
        first[kind + 1] = first[kind] + (unsigned int)sizes[kind];
}

static size_t state_bytes(void)
{
    return sizeof(State) + BYTES(MODEL->states + 2 * MODEL->inputs + MODEL->parameters);
}

Fault flexura_refresh(Unit *unit)
{
    Fault fault = NULL;
    if (unit->is_fresh)
        return NULL;
    for (int i = 0; i < MODEL->inputs; i++)
        unit->u[i] = gains(unit)[i] * inputs(unit)[i];
    if (!unit->is_tuned)
        fault = flexura_tune(unit->dynamics, parameters(unit));
    unit->is_tuned = !fault;
    if (!fault)
        fault = flexura_look(unit->dynamics, states(unit), unit->u);
    unit->is_fresh = !fault;
    return fault;
}

void flexura_restart(Unit *unit)
{
    memset(&unit->state->clock, 0, sizeof(Clock));
    unit->state->time = 0.0;
    unit->state->phase = BEFORE;
    unit->is_tuned = unit->is_fresh = unit->is_warned = 0;
    memset(states(unit), 0, BYTES(MODEL->states + MODEL->inputs));
    if (MODEL->initial)
        memcpy(states(unit), MODEL->initial, BYTES(MODEL->states));
    memcpy(parameters(unit), MODEL->start, BYTES(MODEL->parameters));
    for (int i = 0; i < MODEL->inputs; i++)
        gains(unit)[i] = 1.0;
}

Unit *flexura_new(const char *token, Drive drive, Fault *fault)
{
    Unit *unit = NULL;
    if (!token || strcmp(token, MODEL_TOKEN) != 0)
        *fault = "the token is not that of this model: modelDescription.xml belongs to another";
    else if (MODEL->dt > 0.0 && drive == BY_SOLVER)
        *fault = "a model in steps has no derivatives: it is for co-simulation";
    else if (!(MODEL->dt > 0.0) && drive == BY_CLOCK)
        *fault = "this model has no clock, and no event mode";
    else if (!(unit = calloc(1, sizeof(Unit))) || !(unit->dynamics = flexura_dynamics()) ||
             !(unit->u = calloc((size_t)MODEL->inputs + 1, sizeof(double))) ||
             !(unit->state = calloc(1, state_bytes())))
        *fault = "no memory for an instance";
    else {
        unit->drive = drive;
        count_references(unit->first);
        flexura_restart(unit);
        return unit;
    }
    flexura_free(unit);
    return NULL;
}

void flexura_free(Unit *unit)
{
    if (!unit)
        return;
    flexura_forget(unit->dynamics);
    free(unit->u);
    free(unit->state);
    free(unit);
}

Fault flexura_begin(Unit *unit)
{
    return unit->state->phase == BEFORE ? NULL : "initialization after the start: reset first";
}

Fault flexura_at_time(Unit *unit, double time)
{
    if (!isfinite(time))
        return "a time is not finite";
    unit->state->time = time;
    return NULL;
}

void flexura_run(Unit *unit)
{
    unit->state->phase = RUNNING;
    unit->state->clock.start = unit->state->time;
    unit->state->clock.is_event = unit->drive != BY_STEPS;
}

void flexura_end(Unit *unit)
{
    unit->state->phase = ENDED;
}

double flexura_time(const Unit *unit)
{
    return unit->state->time;
}

size_t flexura_states(void)
{
    return MODEL->dt > 0.0 ? 0 : (size_t)MODEL->states;
}

/* Moves the states by h, or by less, *done, where they leave. */
static Fault move(Unit *unit, double h, double rounding, double *done)
{
    Fault fault = flexura_refresh(unit);
    if (fault || (fault = flexura_move(unit->dynamics, h, rounding, unit->u, states(unit), done)))
        return fault;
    unit->is_fresh = 0;
    for (int i = 0; i < MODEL->states; i++)
        if (!isfinite(states(unit)[i]))
            return "a state has grown beyond all numbers";
    return NULL;
}

Fault flexura_advance(Unit *unit, double time, double h)
{
    const double rounding = 2.0 * DBL_EPSILON * (fabs(time) + h);
    double done = h;
    Fault fault = NULL;
    if (unit->state->phase != RUNNING)
        return "a step before initialization or after the end";
    if (!(h >= 0.0) || !isfinite(h))
        return "a step is a finite time that is not negative";
    if (!(fabs(time - unit->state->time) <= 1e-6 * h + 8.0 * rounding))
        return "a step begins where the last one ended, the first at the start time";
    fault = unit->drive == BY_CLOCK ? flexura_wait(&unit->state->clock, time + h, MODEL->dt)
                                    : move(unit, h, rounding, &done);
    if (fault)
        return fault;
    unit->state->time = time + done;
    if (done < h)
        unit->state->phase = LEFT;
    return NULL;
}

static const char NO_EVENTS[] = "co-simulation without event mode never leaves step mode";

Fault flexura_enter_event(Unit *unit)
{
    if (unit->state->phase == BEFORE || unit->state->phase == ENDED)
        return "event mode before initialization or after the end";
    unit->state->clock.is_event = unit->drive != BY_STEPS;
    return unit->drive == BY_STEPS ? NO_EVENTS : NULL;
}

Fault flexura_leave_event(Unit *unit)
{
    return unit->drive == BY_STEPS ? NO_EVENTS : flexura_leave(&unit->state->clock);
}

Fault flexura_set_clock(Unit *unit, int is_active)
{
    Clock *clock = &unit->state->clock;
    if (!is_active)
        return clock->is_ticking ? "a tick cannot be taken back" : NULL;
    return flexura_begin_tick(clock, unit->state->time, MODEL->dt);
}

int flexura_is_ticking(const Unit *unit)
{
    return unit->state->clock.is_ticking;
}

Fault flexura_update(Unit *unit)
{
    Clock *clock = &unit->state->clock;
    double done = 0.0;
    Fault fault = clock->is_event ? NULL : "discrete states are updated in event mode alone";
    if (fault || !clock->is_ticking)
        return fault;
    fault = move(unit, MODEL->dt, 0.0, &done);
    flexura_end_tick(clock);
    return fault;
}

double flexura_interval(void)
{
    return MODEL->dt;
}

size_t flexura_indicators(void)
{
    return (size_t)MODEL->indicators;
}

const char *flexura_has_left(Unit *unit)
{
    for (int i = 0; i < MODEL->indicators && unit->state->phase == RUNNING && unit->drive == BY_SOLVER; i++)
        if (flexura_indicator(i, states(unit)) <= 0.5 * MODEL->slack)
            unit->state->phase = LEFT;
    return unit->state->phase == LEFT ? MODEL->left : NULL;
}

const char *flexura_caution(Unit *unit)
{
    if (unit->is_warned || !flexura_is_beyond(unit->dynamics, states(unit)))
        return NULL;
    unit->is_warned = 1;
    return MODEL->caution;
}

Fault flexura_keep(const Unit *unit, void **kept)
{
    if (!*kept && !(*kept = malloc(state_bytes())))
        return "no memory for a copy of the state";
    memcpy(*kept, unit->state, state_bytes());
    return NULL;
}

Fault flexura_restore(Unit *unit, const void *kept)
{
    if (!kept)
        return "there is no such state";
    const State *other = kept;
    const size_t parameters_at = (size_t)(MODEL->states + MODEL->inputs);
    if (memcmp(other->numbers + parameters_at, parameters(unit), BYTES(MODEL->parameters)) != 0)
        unit->is_tuned = 0;
    unit->is_fresh = 0;
    memcpy(unit->state, kept, state_bytes());
    return NULL;
}

void flexura_drop(void **kept)
{
    if (kept) {
        free(*kept);
        *kept = NULL;
    }
}

size_t flexura_bytes(void)
{
    return TOKEN_BYTES + state_bytes();
}

Fault flexura_write(const void *kept, char *bytes, size_t size)
{
    if (!kept || size < flexura_bytes())
        return "too few bytes for the state";
    memcpy(bytes, MODEL_TOKEN, TOKEN_BYTES);
    memcpy(bytes + TOKEN_BYTES, kept, state_bytes());
    return NULL;
}

Fault flexura_read(const char *bytes, size_t size, void **kept)
{
    if (size != flexura_bytes() || memcmp(bytes, MODEL_TOKEN, TOKEN_BYTES) != 0)
        return "this is the state of another model";
    if (!*kept && !(*kept = malloc(state_bytes())))
        return "no memory for a copy of the state";
    memcpy(*kept, bytes + TOKEN_BYTES, state_bytes());
    return NULL;
}
