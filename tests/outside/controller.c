/* A controller as a unit of FMI 2.0 written by hand, for model exchange and co-simulation: e = reference - measured, x' = k_i e,
 * output = limit tanh((k_p e + x)/limit).
 * Value references: 0 reference, 1 measured, 2 output, 3 x, 4 x', 5 k_p, 6 k_i, 7 limit.
 * Compiled by units_loop.py; declarations stand here, so that no header is needed. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef void *Component;
typedef unsigned int Reference;
typedef int Status;
enum { OK, WARNING, DISCARD, ERROR };
enum { REFERENCE, MEASURED, OUTPUT, X, RATE, K_P, K_I, LIMIT, COUNT };
typedef struct { int needed, terminate, nominals, states, defined; double next; } EventInfo;

static double value_of(const double *v, Reference r) {
    double e = v[REFERENCE] - v[MEASURED];
    if (r == RATE) return v[K_I] * e;
    return r == OUTPUT ? v[LIMIT] * tanh((v[K_P] * e + v[X]) / v[LIMIT]) : v[r];
}

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
Component fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const void *call, int visible, int logging) {
    (void)name; (void)kind; (void)place; (void)call; (void)visible; (void)logging;
    double *v = strcmp(guid, "controller") ? NULL : calloc(COUNT, sizeof *v);
    if (v) { v[K_P] = 20; v[K_I] = 4000; v[LIMIT] = 48; }
    return v;
}
void fmi2FreeInstance(Component c) { free(c); }
Status fmi2SetDebugLogging(Component c, int on, size_t n, const char *const names[]) { (void)c; (void)on; (void)n; (void)names; return OK; }
Status fmi2SetupExperiment(Component c, int has, double tolerance, double start, int stops, double stop) {
    (void)c; (void)has; (void)tolerance; (void)start; (void)stops; (void)stop;
    return OK;
}
Status fmi2EnterInitializationMode(Component c) { (void)c; return OK; }
Status fmi2ExitInitializationMode(Component c) { (void)c; return OK; }
Status fmi2Terminate(Component c) { (void)c; return OK; }
Status fmi2Reset(Component c) { (void)c; return ERROR; }
Status fmi2GetReal(Component c, const Reference r[], size_t n, double v[]) {
    for (size_t i = 0; i < n; i++) { if (r[i] >= COUNT) return ERROR; v[i] = value_of(c, r[i]); }
    return OK;
}
Status fmi2SetReal(Component c, const Reference r[], size_t n, const double v[]) {
    for (size_t i = 0; i < n; i++) { if (r[i] >= COUNT || r[i] == OUTPUT || r[i] == RATE) return ERROR; ((double *)c)[r[i]] = v[i]; }
    return OK;
}
Status fmi2EnterEventMode(Component c) { (void)c; return OK; }
Status fmi2NewDiscreteStates(Component c, EventInfo *info) { (void)c; memset(info, 0, sizeof *info); return OK; }
Status fmi2EnterContinuousTimeMode(Component c) { (void)c; return OK; }
Status fmi2CompletedIntegratorStep(Component c, int never_back, int *event, int *terminate) {
    (void)c; (void)never_back;
    *event = *terminate = 0;
    return OK;
}
Status fmi2SetTime(Component c, double t) { (void)c; (void)t; return OK; }
Status fmi2SetContinuousStates(Component c, const double x[], size_t n) { if (n != 1) return ERROR; ((double *)c)[X] = x[0]; return OK; }
Status fmi2GetDerivatives(Component c, double v[], size_t n) { if (n != 1) return ERROR; v[0] = value_of(c, RATE); return OK; }
Status fmi2GetEventIndicators(Component c, double v[], size_t n) { (void)c; (void)v; return n ? ERROR : OK; }
Status fmi2GetContinuousStates(Component c, double v[], size_t n) { if (n != 1) return ERROR; v[0] = value_of(c, X); return OK; }
Status fmi2GetNominalsOfContinuousStates(Component c, double v[], size_t n) { (void)c; if (n != 1) return ERROR; v[0] = 1; return OK; }
/* The inputs are held over a step, so the integral is exact. */
Status fmi2DoStep(Component c, double t, double h, int never_back) {
    double *v = c;
    (void)t; (void)never_back;
    v[X] += h * value_of(v, RATE);
    return OK;
}

/* What importers look for and this unit does not have. */
#define REFUSED(name) Status name(void) { return ERROR; }
REFUSED(fmi2GetInteger) REFUSED(fmi2GetBoolean) REFUSED(fmi2GetString) REFUSED(fmi2SetInteger) REFUSED(fmi2SetBoolean) REFUSED(fmi2SetString)
REFUSED(fmi2GetFMUstate) REFUSED(fmi2SetFMUstate) REFUSED(fmi2FreeFMUstate) REFUSED(fmi2SerializedFMUstateSize) REFUSED(fmi2SerializeFMUstate)
REFUSED(fmi2DeSerializeFMUstate) REFUSED(fmi2GetDirectionalDerivative) REFUSED(fmi2SetRealInputDerivatives) REFUSED(fmi2GetRealOutputDerivatives)
REFUSED(fmi2CancelStep) REFUSED(fmi2GetStatus) REFUSED(fmi2GetRealStatus) REFUSED(fmi2GetIntegerStatus) REFUSED(fmi2GetBooleanStatus)
REFUSED(fmi2GetStringStatus)
