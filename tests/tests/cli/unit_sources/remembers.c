/* A unit of FMI 2.0 for model exchange that remembers its steps: der(x) = p - x + m, where m is a tenth of x at the last completed step. */
#include <stdlib.h>

typedef struct { double x, p, m, t; } Unit;
typedef struct { int more, terminate, nominals, states, defined; double next; } EventInfo;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *folder, const void *callbacks, int visible, int log) {
    Unit *unit = calloc(1, sizeof(Unit));
    unit->x = 1;
    unit->p = 2;
    return unit;
}
void fmi2FreeInstance(void *unit) { free(unit); }
int fmi2SetupExperiment(void *unit, int tolerant, double tolerance, double start, int ends, double stop) { return 0; }
int fmi2EnterInitializationMode(void *unit) { return 0; }
int fmi2ExitInitializationMode(void *unit) { return 0; }
int fmi2Terminate(void *unit) { return 0; }
int fmi2EnterEventMode(void *unit) { return 0; }
int fmi2EnterContinuousTimeMode(void *unit) { return 0; }
int fmi2NewDiscreteStates(void *unit, EventInfo *info) {
    *info = (EventInfo){0};
    return 0;
}
static double rate(const Unit *unit) { return unit->p - unit->x + unit->m; }
int fmi2GetReal(void *own, const unsigned *references, size_t count, double *values) {
    Unit *unit = own;
    for (size_t k = 0; k < count; k++)
        values[k] = references[k] == 0 ? unit->x : references[k] == 1 ? rate(unit) : unit->p;
    return 0;
}
int fmi2SetReal(void *own, const unsigned *references, size_t count, const double *values) {
    Unit *unit = own;
    for (size_t k = 0; k < count; k++) {
        if (references[k] == 0) unit->x = values[k];
        if (references[k] == 2) unit->p = values[k];
    }
    return 0;
}
int fmi2GetInteger(void *unit, const unsigned *references, size_t count, int *values) { return count ? 3 : 0; }
int fmi2GetBoolean(void *unit, const unsigned *references, size_t count, int *values) { return count ? 3 : 0; }
int fmi2SetInteger(void *unit, const unsigned *references, size_t count, const int *values) { return count ? 3 : 0; }
int fmi2SetBoolean(void *unit, const unsigned *references, size_t count, const int *values) { return count ? 3 : 0; }
int fmi2SetString(void *unit, const unsigned *references, size_t count, const char *const *values) { return count ? 3 : 0; }
int fmi2CompletedIntegratorStep(void *own, int final, int *event, int *terminate) {
    Unit *unit = own;
    unit->m = 0.1 * unit->x;
    *event = *terminate = 0;
    return 0;
}
int fmi2SetTime(void *own, double t) {
    ((Unit *)own)->t = t;
    return 0;
}
int fmi2SetContinuousStates(void *own, const double *states, size_t count) {
    ((Unit *)own)->x = states[0];
    return 0;
}
int fmi2GetContinuousStates(void *own, double *states, size_t count) {
    states[0] = ((Unit *)own)->x;
    return 0;
}
int fmi2GetDerivatives(void *own, double *rates, size_t count) {
    rates[0] = rate(own);
    return 0;
}
int fmi2GetEventIndicators(void *unit, double *values, size_t count) { return 0; }
int fmi2GetNominalsOfContinuousStates(void *unit, double *values, size_t count) {
    values[0] = 1;
    return 0;
}
