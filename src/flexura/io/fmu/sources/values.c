#include "instance.h"

#include <math.h>
#include <string.h>

/* KINDS when there is none. */
static int kind_of(const Unit *unit, unsigned int reference, int *index)
{
    int kind = 0;
    while (kind < KINDS && reference >= unit->first[kind + 1])
        kind++;
    *index = (int)(reference - unit->first[kind]);
    return kind;
}

/* Whether variables of a kind have values now: those of a clock that drives the unit do while it ticks, and before the start. */
static int has_values(const Unit *unit, int kind)
{
    return unit->drive != BY_CLOCK || (kind != INPUT && kind != OUTPUT && kind != NEXT) ||
           unit->state->phase == BEFORE || unit->state->clock.is_ticking;
}

static const char SILENT[] = "inputs, outputs and next states have values while the clock ticks alone";

Fault flexura_get(Unit *unit, const unsigned int *reference, size_t n, double *value)
{
    const Fault fault = flexura_refresh(unit);
    if (fault)
        return fault;
    for (size_t k = 0; k < n; k++) {
        int i = 0;
        const int kind = kind_of(unit, reference[k], &i);
        if (!has_values(unit, kind))
            return SILENT;
        switch (kind) {
        case INPUT:
            value[k] = inputs(unit)[i];
            break;
        case OUTPUT:
            value[k] = flexura_output(unit->dynamics, i, states(unit), unit->u);
            break;
        case STATE:
            value[k] = states(unit)[i];
            break;
        case DERIVATIVE:
        case NEXT:
            value[k] = flexura_rate(unit->dynamics, i, states(unit), unit->u);
            break;
        case PARAMETER:
            value[k] = parameters(unit)[i];
            break;
        case GAIN:
            value[k] = gains(unit)[i];
            break;
        case INDICATOR:
            value[k] = flexura_indicator(i, states(unit));
            break;
        case TIME:
            value[k] = unit->state->time;
            break;
        default:
            return "there is no number of that value reference";
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
        if (!has_values(unit, kind))
            return SILENT;
        if (kind == STATE && unit->drive != BY_SOLVER && unit->state->phase != BEFORE)
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

Fault flexura_find_clocks(const Unit *unit, const unsigned int *reference, size_t n)
{
    int i = 0;
    for (size_t k = 0; k < n; k++)
        if (kind_of(unit, reference[k], &i) != CLOCK)
            return "there is no clock of that value reference";
    return NULL;
}

Fault flexura_set_states(Unit *unit, const double *x, size_t n)
{
    if (n != flexura_states())
        return "wrong number of states";
    memcpy(states(unit), x, BYTES(n));
    unit->is_fresh = 0;
    return NULL;
}

Fault flexura_get_states(const Unit *unit, double *x, size_t n)
{
    if (n != flexura_states())
        return "wrong number of states";
    memcpy(x, states(unit), BYTES(n));
    return NULL;
}

Fault flexura_get_rates(Unit *unit, double *rates, size_t n)
{
    const Fault fault = flexura_refresh(unit);
    if (n != flexura_states())
        return "wrong number of states";
    for (int i = 0; i < (int)n && !fault; i++)
        rates[i] = flexura_rate(unit->dynamics, i, states(unit), unit->u);
    return fault;
}

Fault flexura_get_nominals(double *nominal, size_t n)
{
    if (n != flexura_states())
        return "wrong number of states";
    memcpy(nominal, MODEL->nominal, BYTES(n));
    return NULL;
}

Fault flexura_get_indicators(Unit *unit, double *indicator, size_t n)
{
    if (n != (size_t)MODEL->indicators)
        return "wrong number of event indicators";
    for (int i = 0; i < MODEL->indicators; i++)
        indicator[i] = flexura_indicator(i, states(unit));
    return NULL;
}

Fault flexura_directional(Unit *unit, const unsigned int *unknown, size_t unknowns, const unsigned int *known,
                          size_t knowns, const double *dknown, double *dunknown)
{
    Fault fault = flexura_refresh(unit);
    Change change = {NULL, NULL, NULL};
    int i = 0;
    if (fault || (fault = flexura_change(unit->dynamics, &change)))
        return fault;
    for (size_t k = 0; k < knowns; k++)
        switch (kind_of(unit, known[k], &i)) {
        case INPUT:
            change.u[i] += gains(unit)[i] * dknown[k];
            break;
        case GAIN:
            change.u[i] += inputs(unit)[i] * dknown[k];
            break;
        case STATE:
            change.x[i] += dknown[k];
            break;
        case PARAMETER:
            change.p[i] += dknown[k];
            break;
        default:
            return "inputs, states, parameters and gains are what is known";
        }
    flexura_changed(unit->dynamics, states(unit), unit->u);
    for (size_t k = 0; k < unknowns; k++)
        switch (kind_of(unit, unknown[k], &i)) {
        case OUTPUT:
            dunknown[k] = flexura_output_change(unit->dynamics, i);
            break;
        case DERIVATIVE:
        case NEXT:
            dunknown[k] = flexura_rate_change(unit->dynamics, i);
            break;
        default:
            return "outputs, derivatives and next states are what is unknown";
        }
    return NULL;
}
