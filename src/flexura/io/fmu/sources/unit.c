#include "unit.h"
#include "step.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#define MODEL (&flexura_model)
#define BYTES(count) (sizeof(double) * (size_t)(count))
#define TOKEN_BYTES sizeof(MODEL_TOKEN)

typedef enum { BEFORE, RUNNING, ENDED } Phase;

enum { INPUT, OUTPUT, STATE, DERIVATIVE, PARAMETER, GAIN, TIME, KINDS };

/* What makes up the state of a unit: states, inputs, parameters and gains behind it. */
typedef struct {
    double time;
    Phase phase;
    double numbers[];
} State;

struct Unit {
    unsigned int first[KINDS + 1];
    int makes_steps, is_tuned, is_fresh;
    double step;               /* the one that E and G are for; negative when for none */
    Model model;               /* A to D for the parameters as they are */
    double *values[4];         /* their entries */
    double *E, *G, *X, *d;     /* exponentials, and ports */
    double *u, *change, *work; /* inputs times their gains, changes of knowns, scratch */
    State *state;
};

/* Where value references of a kind begin: the next after those of the kind before. */
static void count_references(unsigned int *first)
{
    const int sizes[KINDS] = {MODEL->inputs, MODEL->outputs, MODEL->states, MODEL->dt > 0.0 ? 0 : MODEL->states,
                              MODEL->parameters, MODEL->inputs, 1};
    for (int kind = 0; kind < KINDS; kind++)
        first[kind + 1] = first[kind] + (unsigned int)sizes[kind];
}

/* KINDS when there is none. */
static int kind_of(const Unit *unit, unsigned int reference, int *index)
{
    int kind = 0;
    while (kind < KINDS && reference >= unit->first[kind + 1])
        kind++;
    *index = (int)(reference - unit->first[kind]);
    return kind;
}

static double *states(const Unit *unit)
{
    return unit->state->numbers;
}

static double *inputs(const Unit *unit)
{
    return states(unit) + MODEL->states;
}

static double *parameters(const Unit *unit)
{
    return inputs(unit) + MODEL->inputs;
}

static double *gains(const Unit *unit)
{
    return parameters(unit) + MODEL->parameters;
}

static size_t state_bytes(void)
{
    return sizeof(State) + BYTES(MODEL->states + 2 * MODEL->inputs + MODEL->parameters);
}

/* A to D for the parameters as they are. */
static Fault tune(Unit *unit)
{
    const Rows *base[] = {&MODEL->A, &MODEL->B, &MODEL->C, &MODEL->D};
    if (unit->is_tuned)
        return NULL;
    if (!flexura_ports(MODEL, parameters(unit), unit->d, unit->X, unit->X + MODEL->ports * MODEL->ports))
        return "with these parameters the equations have no solution";
    for (int k = 0; k < 4; k++)
        flexura_tuned(MODEL, base[k], k < 2 ? MODEL->states : MODEL->outputs, k < 2 ? &MODEL->into : &MODEL->onto,
                      k % 2 ? &MODEL->of_inputs : &MODEL->of_states, k % 2 ? MODEL->inputs : MODEL->states, unit->d,
                      unit->X, unit->values[k], unit->work);
    unit->is_tuned = 1;
    unit->step = -1.0;
    return NULL;
}

/* Matrices and inputs as they act. */
static Fault refresh(Unit *unit)
{
    Fault fault = NULL;
    if (unit->is_fresh)
        return NULL;
    for (int i = 0; i < MODEL->inputs; i++)
        unit->u[i] = gains(unit)[i] * inputs(unit)[i];
    fault = tune(unit);
    unit->is_fresh = !fault;
    return fault;
}

static double rate(const Unit *unit, int i)
{
    return flexura_row(&unit->model.A, i, states(unit)) + flexura_row(&unit->model.B, i, unit->u);
}

void flexura_restart(Unit *unit)
{
    unit->state->time = 0.0;
    unit->state->phase = BEFORE;
    unit->is_tuned = unit->is_fresh = 0;
    memset(states(unit), 0, BYTES(MODEL->states + MODEL->inputs));
    memcpy(parameters(unit), MODEL->start, BYTES(MODEL->parameters));
    for (int i = 0; i < MODEL->inputs; i++)
        gains(unit)[i] = 1.0;
}

/* One array for all numbers that are worked out from the state. */
static int allocate(Unit *unit)
{
    const int n = MODEL->states, m = MODEL->inputs, r = MODEL->ports;
    const size_t squares = (size_t)MODEL->squares, largest = (size_t)MODEL->largest;
    const size_t entries[] = {(size_t)MODEL->A.start[n], (size_t)MODEL->B.start[n],
                              (size_t)MODEL->C.start[MODEL->outputs], (size_t)MODEL->D.start[MODEL->outputs]};
    const size_t scratch = 5 * largest * largest + 2 * largest + 3 * (size_t)r + (size_t)n + (size_t)m;
    const size_t changes = (size_t)(n + m + 2 * r);
    const size_t all = entries[0] + entries[1] + entries[2] + entries[3];
    unit->E = calloc(2 * squares + all + 2 * (size_t)r * (size_t)r + (size_t)(r + m) + changes + scratch + 1,
                     sizeof(double));
    unit->state = calloc(1, state_bytes());
    if (!unit->E || !unit->state)
        return 0;
    unit->G = unit->E + squares;
    unit->values[0] = unit->G + squares;
    for (int k = 1; k < 4; k++)
        unit->values[k] = unit->values[k - 1] + entries[k - 1];
    unit->X = unit->values[3] + entries[3];
    unit->d = unit->X + 2 * (size_t)r * (size_t)r;
    unit->u = unit->d + r;
    unit->change = unit->u + m;
    unit->work = unit->change + changes;
    unit->model = *MODEL;
    unit->model.A.value = unit->values[0];
    unit->model.B.value = unit->values[1];
    unit->model.C.value = unit->values[2];
    unit->model.D.value = unit->values[3];
    return 1;
}

Unit *flexura_new(const char *token, int makes_steps, Fault *fault)
{
    Unit *unit = NULL;
    if (!token || strcmp(token, MODEL_TOKEN) != 0)
        *fault = "the token is not that of this model: modelDescription.xml belongs to another";
    else if (MODEL->dt > 0.0 && !makes_steps)
        *fault = "a model in steps has no derivatives: it is for co-simulation";
    else if (!(unit = calloc(1, sizeof(Unit))) || !allocate(unit))
        *fault = "no memory for an instance";
    else {
        unit->makes_steps = makes_steps;
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
    free(unit->E);
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
}

void flexura_end(Unit *unit)
{
    unit->state->phase = ENDED;
}

double flexura_time(const Unit *unit)
{
    return unit->state->time;
}

int flexura_makes_steps(const Unit *unit)
{
    return unit->makes_steps;
}

size_t flexura_states(void)
{
    return (size_t)MODEL->states;
}

Fault flexura_get(Unit *unit, const unsigned int *reference, size_t n, double *value)
{
    const Fault fault = refresh(unit);
    if (fault)
        return fault;
    for (size_t k = 0; k < n; k++) {
        int i = 0;
        switch (kind_of(unit, reference[k], &i)) {
        case INPUT:
            value[k] = inputs(unit)[i];
            break;
        case OUTPUT:
            value[k] = flexura_row(&unit->model.C, i, states(unit)) + flexura_row(&unit->model.D, i, unit->u);
            break;
        case STATE:
            value[k] = states(unit)[i];
            break;
        case DERIVATIVE:
            value[k] = rate(unit, i);
            break;
        case PARAMETER:
            value[k] = parameters(unit)[i];
            break;
        case GAIN:
            value[k] = gains(unit)[i];
            break;
        case TIME:
            value[k] = unit->state->time;
            break;
        default:
            return "there is no variable of that value reference";
        }
    }
    return NULL;
}

Fault flexura_set(Unit *unit, const unsigned int *reference, size_t n, const double *value)
{
    unit->is_fresh = 0;
    for (size_t k = 0; k < n; k++) {
        int i = 0;
        const int kind = kind_of(unit, reference[k], &i);
        if (kind != INPUT && kind != STATE && kind != PARAMETER && kind != GAIN)
            return "inputs, states, parameters and gains are what can be set";
        if (kind == STATE && unit->makes_steps && unit->state->phase != BEFORE)
            return "in co-simulation states are set before the start only";
        if (!isfinite(value[k]))
            return "a value is not finite";
        if (kind == PARAMETER && !(value[k] >= 0.0))
            return "damping ratios and masses are not negative";
        if (kind == PARAMETER && value[k] != parameters(unit)[i])
            unit->is_tuned = 0;
        (kind == INPUT ? inputs(unit) : kind == STATE ? states(unit) : kind == GAIN ? gains(unit) : parameters(unit))[i] =
            value[k];
    }
    return NULL;
}

/* Step by step of a discrete model. */
static Fault count_steps(Unit *unit, double h, double rounding)
{
    const double steps = floor(h / MODEL->dt + 0.5);
    if (fabs(h - steps * MODEL->dt) > 1e-6 * MODEL->dt + rounding)
        return "a communication step is a whole number of the steps that the model makes";
    for (double done = 0.0; done < steps; done += 1.0) {
        for (int i = 0; i < MODEL->states; i++)
            unit->change[i] = rate(unit, i);
        memcpy(states(unit), unit->change, BYTES(MODEL->states));
    }
    return NULL;
}

/* Steps that differ by no more than the rounding of the time at which they end are equal. */
static Fault hold(Unit *unit, double h, double rounding)
{
    if (unit->step < 0.0 || fabs(h - unit->step) > rounding) {
        unit->step = h;
        if (!flexura_hold(&unit->model, h, unit->E, unit->G, unit->work)) {
            unit->step = -1.0;
            return "over so long a step the motion grows beyond all numbers";
        }
    }
    flexura_step(&unit->model, unit->E, unit->G, unit->u, states(unit), unit->work);
    return NULL;
}

Fault flexura_advance(Unit *unit, double time, double h)
{
    const double rounding = 2.0 * DBL_EPSILON * (fabs(time) + h);
    Fault fault = NULL;
    if (unit->state->phase != RUNNING)
        return "a step before initialization or after the end";
    if (!(h >= 0.0) || !isfinite(h))
        return "a step is a finite time that is not negative";
    if (!(fabs(time - unit->state->time) <= 1e-6 * h + 8.0 * rounding))
        return "a step begins where the last one ended, the first at the start time";
    if ((fault = refresh(unit)) || (fault = MODEL->dt > 0.0 ? count_steps(unit, h, rounding) : hold(unit, h, rounding)))
        return fault;
    unit->state->time = time + h;
    for (int i = 0; i < MODEL->states; i++)
        if (!isfinite(states(unit)[i]))
            return "a state has grown beyond all numbers";
    return NULL;
}

Fault flexura_set_states(Unit *unit, const double *x, size_t n)
{
    if (n != (size_t)MODEL->states)
        return "wrong number of states";
    memcpy(states(unit), x, BYTES(n));
    return NULL;
}

Fault flexura_get_states(const Unit *unit, double *x, size_t n)
{
    if (n != (size_t)MODEL->states)
        return "wrong number of states";
    memcpy(x, states(unit), BYTES(n));
    return NULL;
}

Fault flexura_get_rates(Unit *unit, double *rates, size_t n)
{
    const Fault fault = refresh(unit);
    if (n != (size_t)MODEL->states)
        return "wrong number of states";
    for (int i = 0; i < MODEL->states && !fault; i++)
        rates[i] = rate(unit, i);
    return fault;
}

Fault flexura_get_nominals(double *nominal, size_t n)
{
    if (n != (size_t)MODEL->states)
        return "wrong number of states";
    memcpy(nominal, MODEL->nominal, BYTES(n));
    return NULL;
}

Fault flexura_directional(Unit *unit, const unsigned int *unknown, size_t unknowns, const unsigned int *known,
                          size_t knowns, const double *dknown, double *dunknown)
{
    double *dx = unit->change, *du = dx + MODEL->states, *dw = du + MODEL->inputs, *dd = dw + MODEL->ports;
    const Fault fault = refresh(unit);
    const Model *own = &unit->model;
    int i = 0;
    if (fault)
        return fault;
    memset(dx, 0, BYTES(MODEL->states + MODEL->inputs + 2 * MODEL->ports));
    for (size_t k = 0; k < knowns; k++)
        switch (kind_of(unit, known[k], &i)) {
        case INPUT:
            du[i] += gains(unit)[i] * dknown[k];
            break;
        case GAIN:
            du[i] += inputs(unit)[i] * dknown[k];
            break;
        case STATE:
            dx[i] += dknown[k];
            break;
        case PARAMETER:
            for (int port = 0; port < MODEL->ports; port++)
                dd[port] += MODEL->parameter[port] == i ? MODEL->slope[port] * dknown[k] : 0.0;
            break;
        default:
            return "inputs, states, parameters and gains are what is known";
        }
    flexura_tuning(MODEL, states(unit), unit->u, unit->d, unit->X, dd, dw, unit->work);
    for (size_t k = 0; k < unknowns; k++)
        switch (kind_of(unit, unknown[k], &i)) {
        case OUTPUT:
            dunknown[k] = flexura_row(&own->C, i, dx) + flexura_row(&own->D, i, du) + flexura_row(&MODEL->onto, i, dw);
            break;
        case DERIVATIVE:
            dunknown[k] = flexura_row(&own->A, i, dx) + flexura_row(&own->B, i, du) + flexura_row(&MODEL->into, i, dw);
            break;
        default:
            return "outputs and derivatives are what is unknown";
        }
    return NULL;
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
