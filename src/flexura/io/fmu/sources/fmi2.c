#include "fmi2.h"
#include "step.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#define MODEL (&flexura_model)
#define BYTES(count) (sizeof(double) * (size_t)(count))

typedef enum { BEFORE, RUNNING, ENDED } Phase;

/* Numbers of an instance that make up its state; `x` are the states and `u` the inputs behind them. */
typedef struct {
    double time;
    Phase phase;
    double numbers[];
} State;

typedef struct {
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    char *name;
    fmi2Type type;
    double step; /* the one that E and G are for; negative when for none */
    double *E, *G, *work, *change;
    State *state;
} Instance;

/* Value references: inputs, outputs, states, derivatives, in this order. */
enum { INPUT, OUTPUT, STATE, DERIVATIVE, NONE };

static int kind_of(fmi2ValueReference vr, int *index)
{
    const int sizes[] = {MODEL->inputs, MODEL->outputs, MODEL->states, MODEL->states};
    for (int kind = INPUT; kind <= DERIVATIVE; kind++) {
        if (vr < (fmi2ValueReference)sizes[kind]) {
            *index = (int)vr;
            return kind;
        }
        vr -= (fmi2ValueReference)sizes[kind];
    }
    return NONE;
}

static double *states(Instance *own)
{
    return own->state->numbers;
}

static double *inputs(Instance *own)
{
    return own->state->numbers + MODEL->states;
}

static size_t state_bytes(void)
{
    return sizeof(State) + BYTES(MODEL->states + MODEL->inputs);
}

static fmi2Status fail(const Instance *own, const char *message)
{
    if (own->log)
        own->log(own->environment, own->name, fmi2Error, "logStatusError", "%s", message);
    return fmi2Error;
}

static void restart(Instance *own)
{
    own->state->time = 0.0;
    own->state->phase = BEFORE;
    memcpy(states(own), MODEL->start, BYTES(MODEL->states));
    memset(inputs(own), 0, BYTES(MODEL->inputs));
}

static double rate(Instance *own, int i)
{
    return flexura_row(&MODEL->A, i, states(own)) + flexura_row(&MODEL->B, i, inputs(own));
}

FMI2_PUBLIC const char *FMI2(fmi2GetTypesPlatform)(void)
{
    return "default";
}

FMI2_PUBLIC const char *FMI2(fmi2GetVersion)(void)
{
    return "2.0";
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *categories)
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

FMI2_PUBLIC void FMI2(fmi2FreeInstance)(fmi2Component c)
{
    Instance *own = c;
    if (!own)
        return;
    free(own->name);
    free(own->E);
    free(own->state);
    free(own);
}

FMI2_PUBLIC fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                                const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                                fmi2Boolean logging)
{
    Instance *own = calloc(1, sizeof(Instance));
    const size_t squares = (size_t)MODEL->squares, largest = (size_t)MODEL->largest;
    const size_t change = (size_t)MODEL->states + (size_t)MODEL->inputs;
    (void)resources, (void)visible, (void)logging;
    if (!own)
        return NULL;
    own->log = callbacks ? callbacks->logger : NULL;
    own->environment = callbacks ? callbacks->componentEnvironment : NULL;
    own->type = type;
    own->step = -1.0;
    own->name = calloc(name ? strlen(name) + 1 : 1, 1);
    own->E = calloc(2 * squares + 5 * largest * largest + 2 * largest + change + 1, sizeof(double));
    own->state = calloc(1, state_bytes());
    if (!own->name || !own->E || !own->state) {
        FMI2(fmi2FreeInstance)(own);
        return NULL;
    }
    if (name)
        memcpy(own->name, name, strlen(name));
    own->G = own->E + squares;
    own->work = own->G + squares;
    own->change = own->work + 5 * largest * largest + 2 * largest;
    if (!guid || strcmp(guid, MODEL_GUID) != 0) {
        fail(own, "the GUID is not that of this model: modelDescription.xml belongs to another");
        FMI2(fmi2FreeInstance)(own);
        return NULL;
    }
    restart(own);
    return own;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                                 fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    Instance *own = c;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    own->state->time = start;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c)
{
    Instance *own = c;
    return own->state->phase == BEFORE ? fmi2OK : fail(own, "initialization after the start: reset first");
}

FMI2_PUBLIC fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c)
{
    Instance *own = c;
    own->state->phase = RUNNING;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2Terminate)(fmi2Component c)
{
    Instance *own = c;
    own->state->phase = ENDED;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2Reset)(fmi2Component c)
{
    restart(c);
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference *vr, size_t n, fmi2Real *value)
{
    Instance *own = c;
    for (size_t k = 0; k < n; k++) {
        int i = 0;
        switch (kind_of(vr[k], &i)) {
        case INPUT:
            value[k] = inputs(own)[i];
            break;
        case OUTPUT:
            value[k] = flexura_row(&MODEL->C, i, states(own)) + flexura_row(&MODEL->D, i, inputs(own));
            break;
        case STATE:
            value[k] = states(own)[i];
            break;
        case DERIVATIVE:
            value[k] = rate(own, i);
            break;
        default:
            return fail(own, "fmi2GetReal: there is no variable of that value reference");
        }
    }
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference *vr, size_t n, const fmi2Real *value)
{
    Instance *own = c;
    for (size_t k = 0; k < n; k++) {
        int i = 0;
        const int kind = kind_of(vr[k], &i);
        if (kind != INPUT && kind != STATE)
            return fail(own, "fmi2SetReal: only inputs and states can be set");
        if (kind == STATE && own->type == fmi2CoSimulation && own->state->phase != BEFORE)
            return fail(own, "fmi2SetReal: in co-simulation states are set before the start only");
        if (!isfinite(value[k]))
            return fail(own, "fmi2SetReal: a value is not finite");
        (kind == INPUT ? inputs(own) : states(own))[i] = value[k];
    }
    return fmi2OK;
}

#define NO_VARIABLES(Type)                                                                                             \
    FMI2_PUBLIC fmi2Status FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference *vr, size_t n,                \
                                               fmi2##Type *value)                                                      \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return n ? fail(c, "all variables of this model are Real") : fmi2OK;                                           \
    }                                                                                                                  \
    FMI2_PUBLIC fmi2Status FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference *vr, size_t n,                \
                                               const fmi2##Type *value)                                                \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return n ? fail(c, "all variables of this model are Real") : fmi2OK;                                           \
    }

NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

FMI2_PUBLIC fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *kept)
{
    const Instance *own = c;
    if (!*kept)
        *kept = malloc(state_bytes());
    if (!*kept)
        return fail(own, "no memory for a copy of the state");
    memcpy(*kept, own->state, state_bytes());
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate kept)
{
    const Instance *own = c;
    if (!kept)
        return fail(own, "fmi2SetFMUstate: no state is given");
    memcpy(own->state, kept, state_bytes());
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *kept)
{
    (void)c;
    if (kept) {
        free(*kept);
        *kept = NULL;
    }
    return fmi2OK;
}

#define GUID_BYTES sizeof(MODEL_GUID)

FMI2_PUBLIC fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate kept, size_t *size)
{
    (void)c, (void)kept;
    *size = GUID_BYTES + state_bytes();
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate kept, fmi2Byte *bytes, size_t size)
{
    if (!kept || size < GUID_BYTES + state_bytes())
        return fail(c, "fmi2SerializeFMUstate: no state, or too little room");
    memcpy(bytes, MODEL_GUID, GUID_BYTES);
    memcpy(bytes + GUID_BYTES, kept, state_bytes());
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte *bytes, size_t size,
                                                     fmi2FMUstate *kept)
{
    if (size != GUID_BYTES + state_bytes() || memcmp(bytes, MODEL_GUID, GUID_BYTES) != 0)
        return fail(c, "fmi2DeSerializeFMUstate: this is the state of another model");
    if (!*kept)
        *kept = malloc(state_bytes());
    if (!*kept)
        return fail(c, "no memory for a copy of the state");
    memcpy(*kept, bytes + GUID_BYTES, state_bytes());
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference *unknown,
                                                          size_t unknowns, const fmi2ValueReference *known,
                                                          size_t knowns, const fmi2Real *dknown, fmi2Real *dunknown)
{
    Instance *own = c;
    double *dx = own->change, *du = own->change + MODEL->states;
    int i = 0;
    memset(own->change, 0, BYTES(MODEL->states + MODEL->inputs));
    for (size_t k = 0; k < knowns; k++) {
        const int kind = kind_of(known[k], &i);
        if (kind != INPUT && kind != STATE)
            return fail(own, "fmi2GetDirectionalDerivative: inputs and states are what is known");
        (kind == INPUT ? du : dx)[i] += dknown[k];
    }
    for (size_t k = 0; k < unknowns; k++)
        switch (kind_of(unknown[k], &i)) {
        case OUTPUT:
            dunknown[k] = flexura_row(&MODEL->C, i, dx) + flexura_row(&MODEL->D, i, du);
            break;
        case DERIVATIVE:
            dunknown[k] = flexura_row(&MODEL->A, i, dx) + flexura_row(&MODEL->B, i, du);
            break;
        default:
            return fail(own, "fmi2GetDirectionalDerivative: outputs and derivatives are what is unknown");
        }
    return fmi2OK;
}

/* Model exchange */

FMI2_PUBLIC fmi2Status FMI2(fmi2EnterEventMode)(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    (void)c;
    memset(info, 0, sizeof(*info));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2EnterContinuousTimeMode)(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2CompletedIntegratorStep)(fmi2Component c, fmi2Boolean no_rollback, fmi2Boolean *event,
                                                         fmi2Boolean *terminate)
{
    (void)c, (void)no_rollback;
    *event = *terminate = fmi2False;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetTime)(fmi2Component c, fmi2Real time)
{
    Instance *own = c;
    own->state->time = time;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetContinuousStates)(fmi2Component c, const fmi2Real *x, size_t n)
{
    Instance *own = c;
    if (n != (size_t)MODEL->states)
        return fail(own, "fmi2SetContinuousStates: wrong number of states");
    memcpy(states(own), x, BYTES(n));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetContinuousStates)(fmi2Component c, fmi2Real *x, size_t n)
{
    Instance *own = c;
    if (n != (size_t)MODEL->states)
        return fail(own, "fmi2GetContinuousStates: wrong number of states");
    memcpy(x, states(own), BYTES(n));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetDerivatives)(fmi2Component c, fmi2Real *derivatives, size_t n)
{
    Instance *own = c;
    if (n != (size_t)MODEL->states)
        return fail(own, "fmi2GetDerivatives: wrong number of states");
    for (int i = 0; i < MODEL->states; i++)
        derivatives[i] = rate(own, i);
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetEventIndicators)(fmi2Component c, fmi2Real *indicators, size_t n)
{
    (void)indicators;
    return n ? fail(c, "fmi2GetEventIndicators: this model has none") : fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real *nominal, size_t n)
{
    if (n != (size_t)MODEL->states)
        return fail(c, "fmi2GetNominalsOfContinuousStates: wrong number of states");
    memcpy(nominal, MODEL->nominal, BYTES(n));
    return fmi2OK;
}

/* Co-simulation */

FMI2_PUBLIC fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                         const fmi2Integer *order, const fmi2Real *value)
{
    (void)vr, (void)order, (void)value;
    return n ? fail(c, "inputs are held over a step: they take no derivatives") : fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                          const fmi2Integer *order, fmi2Real *value)
{
    (void)vr, (void)order, (void)value;
    return n ? fail(c, "derivatives of outputs are not provided") : fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_rollback)
{
    Instance *own = c;
    (void)no_rollback;
    if (own->state->phase != RUNNING)
        return fail(own, "fmi2DoStep: before initialization or after the end");
    if (!(h >= 0.0) || !isfinite(h))
        return fail(own, "fmi2DoStep: a step is a finite time that is not negative");
    /* steps that differ by no more than the rounding of the time at which they end are equal */
    if (own->step < 0.0 || fabs(h - own->step) > 2.0 * DBL_EPSILON * (fabs(time) + h)) {
        own->step = h;
        if (!flexura_hold(MODEL, h, own->E, own->G, own->work)) {
            own->step = -1.0;
            return fail(own, "fmi2DoStep: over so long a step the motion grows beyond all numbers");
        }
    }
    flexura_step(MODEL, own->E, own->G, inputs(own), states(own), own->work);
    own->state->time = time + h;
    for (int i = 0; i < MODEL->states; i++)
        if (!isfinite(states(own)[i]))
            return fail(own, "fmi2DoStep: a state has grown beyond all numbers");
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2CancelStep)(fmi2Component c)
{
    return fail(c, "steps are complete when fmi2DoStep returns");
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const Instance *own = c;
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = own->state->time;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    (void)c, (void)kind;
    *value = fmi2False;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
