/* The part of the FMI 2.0 C interface that a functional mock-up unit has to provide. */
#ifndef FLEXURA_FMI2_H
#define FLEXURA_FMI2_H

#include <stddef.h>

#if defined(FMI2_FUNCTION_PREFIX)
#define FMI2_JOIN_(a, b) a##b
#define FMI2_JOIN(a, b) FMI2_JOIN_(a, b)
#define FMI2(name) FMI2_JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif

#if defined(_WIN32)
#define FMI2_PUBLIC __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_PUBLIC __attribute__((visibility("default")))
#else
#define FMI2_PUBLIC
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;

enum { fmi2False = 0, fmi2True = 1 };

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

#endif
