#include "fmi3.h"
#include "unit.h"

#include <stdlib.h>

typedef struct {
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
    Unit *unit;
    int may_return_early, is_told; /* what the interval of the clock is */
} Instance;

static fmi3Status tell(const Instance *own, fmi3Status status, const char *category, const char *text)
{
    if (text && own->log)
        own->log(own->environment, status, category, text);
    return text ? status : fmi3OK;
}

/* Tells what is wrong, if anything is. */
static fmi3Status report(const Instance *own, Fault fault)
{
    return tell(own, fmi3Error, "logStatusError", fault);
}

static Unit *unit_of(fmi3Instance instance)
{
    return ((Instance *)instance)->unit;
}

FMI3_PUBLIC const char *FMI3(fmi3GetVersion)(void)
{
    return "3.0";
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance instance, fmi3Boolean on, size_t n,
                                                 const fmi3String categories[])
{
    (void)instance, (void)on, (void)n, (void)categories; /* errors alone are told, and these always */
    return fmi3OK;
}

FMI3_PUBLIC void FMI3(fmi3FreeInstance)(fmi3Instance instance)
{
    Instance *own = instance;
    if (!own)
        return;
    flexura_free(own->unit);
    free(own);
}

static fmi3Instance instantiate(fmi3String token, Drive drive, Fault fault, fmi3InstanceEnvironment environment,
                                fmi3LogMessageCallback log)
{
    Instance *own = calloc(1, sizeof(Instance));
    if (!own)
        return NULL;
    own->log = log;
    own->environment = environment;
    own->unit = fault ? NULL : flexura_new(token, drive, &fault);
    if (own->unit)
        return own;
    report(own, fault);
    FMI3(fmi3FreeInstance)(own);
    return NULL;
}

FMI3_PUBLIC fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
                                                            fmi3Boolean visible, fmi3Boolean logging,
                                                            fmi3InstanceEnvironment environment,
                                                            fmi3LogMessageCallback log)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    return instantiate(token, flexura_interval() > 0.0 ? BY_CLOCK : BY_SOLVER, NULL, environment, log);
}

FMI3_PUBLIC fmi3Instance FMI3(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean has_events, fmi3Boolean may_return_early, const fmi3ValueReference intermediate[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    const Fault fault = n ? "there are no intermediate updates" : NULL;
    Instance *own = instantiate(token, has_events ? BY_CLOCK : BY_STEPS, fault, environment, log);
    (void)name, (void)resources, (void)visible, (void)logging, (void)intermediate, (void)update;
    if (own)
        own->may_return_early = may_return_early;
    return own;
}

FMI3_PUBLIC fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    return instantiate(token, BY_CLOCK, "this model is not for scheduled execution", environment, log);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance instance, fmi3Boolean has_tolerance,
                                                         fmi3Float64 tolerance, fmi3Float64 start,
                                                         fmi3Boolean has_stop, fmi3Float64 stop)
{
    const Fault fault = flexura_begin(unit_of(instance));
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    return report(instance, fault ? fault : flexura_at_time(unit_of(instance), start));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance instance)
{
    flexura_run(unit_of(instance));
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance instance)
{
    return report(instance, flexura_enter_event(unit_of(instance)));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3Terminate)(fmi3Instance instance)
{
    flexura_end(unit_of(instance));
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3Reset)(fmi3Instance instance)
{
    Instance *own = instance;
    own->is_told = 0;
    flexura_restart(own->unit);
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                            fmi3Float64 values[], size_t count)
{
    return report(instance, n != count ? "all variables are scalars" : flexura_get(unit_of(instance), vr, n, values));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                            const fmi3Float64 values[], size_t count)
{
    return report(instance, n != count ? "all variables are scalars" : flexura_set(unit_of(instance), vr, n, values));
}

/* What this model has none of: right where nothing is asked for, and told otherwise. */

static fmi3Status none(const Instance *own, size_t n)
{
    return report(own, n ? "all variables of this model but a clock are Float64" : NULL);
}

#define NO_VARIABLES(Type)                                                                                             \
    FMI3_PUBLIC fmi3Status FMI3(fmi3Get##Type)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,         \
                                               fmi3##Type values[], size_t count)                                      \
    {                                                                                                                  \
        (void)vr, (void)values, (void)count;                                                                           \
        return none(instance, n);                                                                                      \
    }                                                                                                                  \
    FMI3_PUBLIC fmi3Status FMI3(fmi3Set##Type)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,         \
                                               const fmi3##Type values[], size_t count)                                \
    {                                                                                                                  \
        (void)vr, (void)values, (void)count;                                                                           \
        return none(instance, n);                                                                                      \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

FMI3_PUBLIC fmi3Status FMI3(fmi3GetBinary)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                           size_t sizes[], fmi3Binary values[], size_t count)
{
    (void)vr, (void)sizes, (void)values, (void)count;
    return none(instance, n);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetBinary)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                           const size_t sizes[], const fmi3Binary values[], size_t count)
{
    (void)vr, (void)sizes, (void)values, (void)count;
    return none(instance, n);
}

/* The clock, whose interval is that of modelDescription.xml */

FMI3_PUBLIC fmi3Status FMI3(fmi3GetClock)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                          fmi3Clock values[])
{
    const Fault fault = flexura_find_clocks(unit_of(instance), vr, n);
    for (size_t k = 0; k < n && !fault; k++)
        values[k] = flexura_is_ticking(unit_of(instance));
    return report(instance, fault);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetClock)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                          const fmi3Clock values[])
{
    Fault fault = flexura_find_clocks(unit_of(instance), vr, n);
    for (size_t k = 0; k < n && !fault; k++)
        fault = flexura_set_clock(unit_of(instance), values[k]);
    return report(instance, fault);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                                    fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    Instance *own = instance;
    const Fault fault = flexura_find_clocks(own->unit, vr, n);
    for (size_t k = 0; k < n && !fault; k++) {
        intervals[k] = flexura_interval();
        qualifiers[k] = own->is_told ? fmi3IntervalUnchanged : fmi3IntervalChanged;
        own->is_told = 1;
    }
    return report(own, fault);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetShiftDecimal)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                                 fmi3Float64 shifts[])
{
    const Fault fault = flexura_find_clocks(unit_of(instance), vr, n);
    for (size_t k = 0; k < n && !fault; k++)
        shifts[k] = 0.0;
    return report(instance, fault);
}

#define NOT_OF_CLOCK(name, ...)                                                                                        \
    FMI3_PUBLIC fmi3Status FMI3(name)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, __VA_ARGS__)

static fmi3Status constant(const Instance *own, size_t n)
{
    return report(own, n ? "the interval of a clock is constant, from the start on, and no fraction" : NULL);
}

NOT_OF_CLOCK(fmi3GetIntervalFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)vr, (void)counters, (void)resolutions, (void)qualifiers;
    return constant(instance, n);
}

NOT_OF_CLOCK(fmi3GetShiftFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)vr, (void)counters, (void)resolutions;
    return constant(instance, n);
}

NOT_OF_CLOCK(fmi3SetIntervalDecimal, const fmi3Float64 intervals[])
{
    (void)vr, (void)intervals;
    return constant(instance, n);
}

NOT_OF_CLOCK(fmi3SetIntervalFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)vr, (void)counters, (void)resolutions;
    return constant(instance, n);
}

NOT_OF_CLOCK(fmi3SetShiftDecimal, const fmi3Float64 shifts[])
{
    (void)vr, (void)shifts;
    return constant(instance, n);
}

NOT_OF_CLOCK(fmi3SetShiftFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)vr, (void)counters, (void)resolutions;
    return constant(instance, n);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance instance, fmi3ValueReference clock,
                                                        fmi3Float64 time)
{
    (void)clock, (void)time;
    return report(instance, "this model is not for scheduled execution");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance instance)
{
    return report(instance, "this model has no structural parameters");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance instance)
{
    return report(instance, "this model has no structural parameters");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance instance, fmi3ValueReference vr,
                                                                 size_t *count)
{
    (void)vr, (void)count;
    return report(instance, "dependencies are those of modelDescription.xml");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance instance, fmi3ValueReference vr,
                                                         size_t elements[], fmi3ValueReference independents[],
                                                         size_t of_independents[], fmi3DependencyKind kinds[],
                                                         size_t count)
{
    (void)vr, (void)elements, (void)independents, (void)of_independents, (void)kinds, (void)count;
    return report(instance, "dependencies are those of modelDescription.xml");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetAdjointDerivative)(fmi3Instance instance, const fmi3ValueReference unknown[],
                                                      size_t unknowns, const fmi3ValueReference known[], size_t knowns,
                                                      const fmi3Float64 seed[], size_t seeds,
                                                      fmi3Float64 sensitivity[], size_t sensitivities)
{
    (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)seeds, (void)sensitivity;
    (void)sensitivities;
    return report(instance, "adjoint derivatives are not provided");
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                                      const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
{
    (void)vr, (void)orders, (void)values, (void)count;
    return report(instance, n ? "derivatives of outputs are not provided" : NULL);
}

/* States of the unit */

FMI3_PUBLIC fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance instance, fmi3FMUState *kept)
{
    return report(instance, flexura_keep(unit_of(instance), kept));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance instance, fmi3FMUState kept)
{
    return report(instance, flexura_restore(unit_of(instance), kept));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance instance, fmi3FMUState *kept)
{
    (void)instance;
    flexura_drop(kept);
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance instance, fmi3FMUState kept, size_t *size)
{
    (void)instance, (void)kept;
    *size = flexura_bytes();
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance instance, fmi3FMUState kept, fmi3Byte bytes[],
                                                   size_t size)
{
    return report(instance, flexura_write(kept, (char *)bytes, size));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                                     fmi3FMUState *kept)
{
    return report(instance, flexura_read((const char *)bytes, size, kept));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetDirectionalDerivative)(fmi3Instance instance, const fmi3ValueReference unknown[],
                                                          size_t unknowns, const fmi3ValueReference known[],
                                                          size_t knowns, const fmi3Float64 seed[], size_t seeds,
                                                          fmi3Float64 sensitivity[], size_t sensitivities)
{
    if (seeds != knowns || sensitivities != unknowns)
        return report(instance, "all variables are scalars");
    return report(instance,
                  flexura_directional(unit_of(instance), unknown, unknowns, known, knowns, seed, sensitivity));
}

/* Event mode, and model exchange */

FMI3_PUBLIC fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance instance, fmi3Boolean *again,
                                                      fmi3Boolean *terminate, fmi3Boolean *new_nominals,
                                                      fmi3Boolean *new_states, fmi3Boolean *has_next,
                                                      fmi3Float64 *next)
{
    const Fault fault = flexura_update(unit_of(instance));
    const char *left = flexura_has_left(unit_of(instance));
    (void)next;
    *again = *new_nominals = *new_states = *has_next = fmi3False;
    *terminate = left != NULL;
    tell(instance, fmi3Discard, "logStatusDiscard", left);
    return report(instance, fault);
}

FMI3_PUBLIC fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance instance)
{
    return report(instance, flexura_leave_event(unit_of(instance)));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance instance, fmi3Boolean no_rollback,
                                                         fmi3Boolean *event, fmi3Boolean *terminate)
{
    (void)no_rollback;
    *event = *terminate = fmi3False;
    tell(instance, fmi3Warning, "logStatusWarning", flexura_caution(unit_of(instance)));
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetTime)(fmi3Instance instance, fmi3Float64 time)
{
    return report(instance, flexura_at_time(unit_of(instance), time));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance instance, const fmi3Float64 x[], size_t n)
{
    return report(instance, flexura_set_states(unit_of(instance), x, n));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    return report(instance, flexura_get_states(unit_of(instance), x, n));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance instance, fmi3Float64 rates[], size_t n)
{
    return report(instance, flexura_get_rates(unit_of(instance), rates, n));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance instance, fmi3Float64 nominals[], size_t n)
{
    return report(instance, flexura_get_nominals(nominals, n));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance instance, fmi3Float64 indicators[], size_t n)
{
    return report(instance, flexura_get_indicators(unit_of(instance), indicators, n));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = flexura_indicators();
    return fmi3OK;
}

FMI3_PUBLIC fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = flexura_states();
    return fmi3OK;
}

/* Co-simulation */

FMI3_PUBLIC fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance instance)
{
    return report(instance, flexura_leave_event(unit_of(instance)));
}

FMI3_PUBLIC fmi3Status FMI3(fmi3DoStep)(fmi3Instance instance, fmi3Float64 time, fmi3Float64 h,
                                        fmi3Boolean no_rollback, fmi3Boolean *event, fmi3Boolean *terminate,
                                        fmi3Boolean *is_early, fmi3Float64 *reached)
{
    const Instance *own = instance;
    const Fault fault = flexura_advance(own->unit, time, h);
    const char *left = fault ? NULL : flexura_has_left(own->unit);
    fmi3Status status = fmi3OK;
    (void)no_rollback;
    *event = fmi3False;
    *terminate = left != NULL;
    *is_early = left && own->may_return_early;
    *reached = flexura_time(own->unit);
    tell(own, fmi3Warning, "logStatusWarning", flexura_caution(own->unit));
    if (fault)
        return report(own, fault);
    status = tell(own, fmi3Discard, "logStatusDiscard", left);
    return own->may_return_early ? fmi3OK : status;
}
