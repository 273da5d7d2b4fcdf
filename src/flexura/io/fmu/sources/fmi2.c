#include "fmi2.h"
#include "unit.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    char *name;
    Unit *unit;
} Instance;

static fmi2Status tell(const Instance *own, fmi2Status status, const char *category, const char *text)
{
    if (text && own->log)
        own->log(own->environment, own->name, status, category, "%s", text);
    return text ? status : fmi2OK;
}

/* Tells what is wrong, if anything is. */
static fmi2Status report(const Instance *own, Fault fault)
{
    return tell(own, fmi2Error, "logStatusError", fault);
}

static Unit *unit_of(fmi2Component c)
{
    return ((Instance *)c)->unit;
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
    flexura_free(own->unit);
    free(own->name);
    free(own);
}

FMI2_PUBLIC fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                                const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                                                fmi2Boolean logging)
{
    Instance *own = calloc(1, sizeof(Instance));
    Fault fault = "no memory for an instance";
    (void)resources, (void)visible, (void)logging;
    if (!own)
        return NULL;
    own->log = callbacks ? callbacks->logger : NULL;
    own->environment = callbacks ? callbacks->componentEnvironment : NULL;
    own->name = calloc(name ? strlen(name) + 1 : 1, 1);
    if (own->name && name)
        memcpy(own->name, name, strlen(name));
    own->unit = own->name ? flexura_new(guid, type == fmi2CoSimulation ? BY_STEPS : BY_SOLVER, &fault) : NULL;
    if (!own->unit) {
        report(own, fault);
        FMI2(fmi2FreeInstance)(own);
        return NULL;
    }
    return own;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                                 fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    return report(c, flexura_at_time(unit_of(c), start));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c)
{
    return report(c, flexura_begin(unit_of(c)));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c)
{
    flexura_run(unit_of(c));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2Terminate)(fmi2Component c)
{
    flexura_end(unit_of(c));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2Reset)(fmi2Component c)
{
    flexura_restart(unit_of(c));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference *vr, size_t n, fmi2Real *value)
{
    return report(c, flexura_get(unit_of(c), vr, n, value));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference *vr, size_t n, const fmi2Real *value)
{
    return report(c, flexura_set(unit_of(c), vr, n, value));
}

#define NO_VARIABLES(Type)                                                                                             \
    FMI2_PUBLIC fmi2Status FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference *vr, size_t n,                \
                                               fmi2##Type *value)                                                      \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return report(c, n ? "all variables of this model are Real" : NULL);                                           \
    }                                                                                                                  \
    FMI2_PUBLIC fmi2Status FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference *vr, size_t n,                \
                                               const fmi2##Type *value)                                                \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return report(c, n ? "all variables of this model are Real" : NULL);                                           \
    }

NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

FMI2_PUBLIC fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *kept)
{
    return report(c, flexura_keep(unit_of(c), kept));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate kept)
{
    return report(c, flexura_restore(unit_of(c), kept));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *kept)
{
    (void)c;
    flexura_drop(kept);
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate kept, size_t *size)
{
    (void)c, (void)kept;
    *size = flexura_bytes();
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate kept, fmi2Byte *bytes, size_t size)
{
    return report(c, flexura_write(kept, bytes, size));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte *bytes, size_t size,
                                                     fmi2FMUstate *kept)
{
    return report(c, flexura_read(bytes, size, kept));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference *unknown,
                                                          size_t unknowns, const fmi2ValueReference *known,
                                                          size_t knowns, const fmi2Real *dknown, fmi2Real *dunknown)
{
    return report(c, flexura_directional(unit_of(c), unknown, unknowns, known, knowns, dknown, dunknown));
}

/* Model exchange */

FMI2_PUBLIC fmi2Status FMI2(fmi2EnterEventMode)(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    const char *left = flexura_has_left(unit_of(c));
    memset(info, 0, sizeof(*info));
    info->terminateSimulation = left ? fmi2True : fmi2False;
    tell(c, fmi2Discard, "logStatusDiscard", left);
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
    (void)no_rollback;
    *event = *terminate = fmi2False;
    tell(c, fmi2Warning, "logStatusWarning", flexura_caution(unit_of(c)));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetTime)(fmi2Component c, fmi2Real time)
{
    return report(c, flexura_at_time(unit_of(c), time));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2SetContinuousStates)(fmi2Component c, const fmi2Real *x, size_t n)
{
    return report(c, flexura_set_states(unit_of(c), x, n));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetContinuousStates)(fmi2Component c, fmi2Real *x, size_t n)
{
    return report(c, flexura_get_states(unit_of(c), x, n));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetDerivatives)(fmi2Component c, fmi2Real *derivatives, size_t n)
{
    return report(c, flexura_get_rates(unit_of(c), derivatives, n));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetEventIndicators)(fmi2Component c, fmi2Real *indicators, size_t n)
{
    return report(c, flexura_get_indicators(unit_of(c), indicators, n));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetNominalsOfContinuousStates)(fmi2Component c, fmi2Real *nominal, size_t n)
{
    return report(c, flexura_get_nominals(nominal, n));
}

/* Co-simulation */

FMI2_PUBLIC fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                         const fmi2Integer *order, const fmi2Real *value)
{
    (void)vr, (void)order, (void)value;
    return report(c, n ? "inputs are held over a step: they take no derivatives" : NULL);
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                          const fmi2Integer *order, fmi2Real *value)
{
    (void)vr, (void)order, (void)value;
    return report(c, n ? "derivatives of outputs are not provided" : NULL);
}

FMI2_PUBLIC fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_rollback)
{
    const Fault fault = flexura_advance(unit_of(c), time, h);
    (void)no_rollback;
    tell(c, fmi2Warning, "logStatusWarning", flexura_caution(unit_of(c)));
    return fault ? report(c, fault) : tell(c, fmi2Discard, "logStatusDiscard", flexura_has_left(unit_of(c)));
}

FMI2_PUBLIC fmi2Status FMI2(fmi2CancelStep)(fmi2Component c)
{
    return report(c, "steps are complete when fmi2DoStep returns");
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = flexura_time(unit_of(c));
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = flexura_has_left(unit_of(c)) ? fmi2True : fmi2False;
    return fmi2OK;
}

FMI2_PUBLIC fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
