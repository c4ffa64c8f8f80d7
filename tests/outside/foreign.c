/* A unit of FMI 2.0 written by hand, for model exchange and co-simulation, that behaves or misbehaves as its parameter `trouble` says.
 *
 * x' = -k x + u; where x falls to 1/2 it is set back to 1 and `count` grows by one.  With u = 0 a turn takes ln(2)/k.
 * Value references: Real 0 x, 1 der(x), 2 k, 3 u, 4 steps told; Integer 0 count, 1 trouble; String 0 label.
 * Compiled by units_import.py; declarations stand here, so that no header is needed. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef void *Component;
typedef unsigned int Reference;
typedef int Status;
enum { OK, WARNING, DISCARD, ERROR, FATAL };
typedef void (*Logger)(void *, const char *, Status, const char *, const char *, ...);
typedef struct { Logger logger; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished; void *environment; } Callbacks;
typedef struct { int needed, terminate, nominals, states, defined; double next; } EventInfo;

enum { NONE, CRASH, HANG, END, DISCARDS, COMPLAINS, PRINTS, STEP_EVENTS, CRASH_AT_START, ABORTS, TERMINATES, NO_INSTANCE, FORKS };
typedef struct { const Callbacks *call; double t, x, k, u, told; int count, trouble, event, forked; char label[100]; } Unit;

static int is_due(Unit *unit) { return unit->t > 0.5; }

/* What `trouble` does where rates are asked for, or a step. */
static Status misbehave(Unit *unit) {
    if (!is_due(unit)) return OK;
    switch (unit->trouble) {
    case CRASH: *(volatile int *)8 = 1; break;
    case HANG: for (;;) usleep(1000); break;
    case END: _exit(7);
    case ABORTS: abort();
    case DISCARDS: return DISCARD;
    case FORKS: if (unit->forked++ == 0 && fork() == 0) for (;;) pause(); break;
    case COMPLAINS:
        unit->call->logger(unit->call->environment, "one", ERROR, "logStatusError", "%s: x is %g after %d turns, 100%%", unit->label, unit->x, unit->count);
        return ERROR;
    }
    return OK;
}

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
Component fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const Callbacks *call, int visible, int logging) {
    (void)name; (void)kind; (void)visible; (void)logging;
    if (strcmp(guid, "foreign") || strncmp(place, "file:///", 8)) return NULL;
    Unit *unit = call->allocate(1, sizeof *unit);
    unit->call = call;
    unit->x = 1;
    unit->k = 1;
    strcpy(unit->label, "valve");
    return unit;
}
void fmi2FreeInstance(Component c) { Unit *unit = c; if (unit) unit->call->release(unit); }
Status fmi2SetupExperiment(Component c, int has, double tolerance, double start, int stops, double stop) {
    (void)has; (void)tolerance; (void)stops; (void)stop;
    ((Unit *)c)->t = start;
    return OK;
}
Status fmi2EnterInitializationMode(Component c) {
    if (((Unit *)c)->trouble == CRASH_AT_START) *(volatile int *)8 = 1;
    return OK;
}
Status fmi2ExitInitializationMode(Component c) { (void)c; return OK; }
Status fmi2Terminate(Component c) { (void)c; return OK; }
Status fmi2Reset(Component c) { (void)c; return OK; }

Status fmi2GetReal(Component c, const Reference r[], size_t n, double v[]) {
    Unit *unit = c;
    for (size_t i = 0; i < n; i++)
        switch (r[i]) {
        case 0: v[i] = unit->x; break;
        case 1: v[i] = -unit->k * unit->x + unit->u; break;
        case 2: v[i] = unit->k; break;
        case 3: v[i] = unit->u; break;
        case 4: v[i] = unit->told; break;
        default: return ERROR;
        }
    return OK;
}
Status fmi2GetInteger(Component c, const Reference r[], size_t n, int v[]) {
    Unit *unit = c;
    for (size_t i = 0; i < n; i++) v[i] = r[i] ? unit->trouble : unit->count;
    return OK;
}
Status fmi2GetBoolean(Component c, const Reference r[], size_t n, int v[]) { (void)c; (void)r; (void)n; (void)v; return ERROR; }
Status fmi2GetString(Component c, const Reference r[], size_t n, const char *v[]) { (void)r; if (n) v[0] = ((Unit *)c)->label; return OK; }
Status fmi2SetReal(Component c, const Reference r[], size_t n, const double v[]) {
    Unit *unit = c;
    for (size_t i = 0; i < n; i++)
        switch (r[i]) {
        case 0: unit->x = v[i]; break;
        case 2: unit->k = v[i]; break;
        case 3: unit->u = v[i]; break;
        default: return ERROR;
        }
    return OK;
}
Status fmi2SetInteger(Component c, const Reference r[], size_t n, const int v[]) {
    for (size_t i = 0; i < n; i++) { if (r[i] != 1) return ERROR; ((Unit *)c)->trouble = v[i]; }
    return OK;
}
Status fmi2SetString(Component c, const Reference r[], size_t n, const char *const v[]) {
    (void)r;
    if (n) snprintf(((Unit *)c)->label, 100, "%s", v[0]);
    return OK;
}

static int turn(Unit *unit) {
    if (unit->x > 0.5) return 0;
    unit->x = 1;
    unit->count++;
    return 1;
}

Status fmi2EnterEventMode(Component c) { ((Unit *)c)->event = 1; return OK; }
Status fmi2NewDiscreteStates(Component c, EventInfo *info) {
    Unit *unit = c;
    memset(info, 0, sizeof *info);
    info->states = turn(unit);
    info->terminate = unit->trouble == TERMINATES && unit->count > 0;
    return OK;
}
Status fmi2EnterContinuousTimeMode(Component c) { ((Unit *)c)->event = 0; return OK; }
Status fmi2CompletedIntegratorStep(Component c, int never_back, int *event, int *terminate) {
    Unit *unit = c;
    (void)never_back;
    unit->told++;
    *event = unit->trouble == STEP_EVENTS && fmod(unit->told, 5) == 0;
    *terminate = 0;
    return OK;
}
Status fmi2SetTime(Component c, double t) { ((Unit *)c)->t = t; return ((Unit *)c)->event ? ERROR : OK; }
Status fmi2SetContinuousStates(Component c, const double x[], size_t n) { if (n != 1) return ERROR; ((Unit *)c)->x = x[0]; return OK; }
Status fmi2GetDerivatives(Component c, double v[], size_t n) {
    Unit *unit = c;
    if (n != 1) return ERROR;
    if (unit->trouble == PRINTS) for (int i = 0; i < 1000; i++) printf("a line that the unit prints by itself\n");
    v[0] = -unit->k * unit->x + unit->u;
    return misbehave(unit);
}
Status fmi2GetEventIndicators(Component c, double v[], size_t n) { if (n != 1) return ERROR; v[0] = ((Unit *)c)->x - 0.5; return OK; }
Status fmi2GetContinuousStates(Component c, double v[], size_t n) { if (n != 1) return ERROR; v[0] = ((Unit *)c)->x; return OK; }
Status fmi2GetNominalsOfContinuousStates(Component c, double v[], size_t n) { (void)c; if (n != 1) return ERROR; v[0] = 1; return OK; }

Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n, const int o[], const double v[]) { (void)c; (void)r; (void)n; (void)o; (void)v; return ERROR; }
static double reached;
static int ended;
Status fmi2DoStep(Component c, double t, double h, int never_back) {
    Unit *unit = c;
    double rest = h;
    (void)never_back;
    unit->t = t;
    Status status = misbehave(unit);
    if (status > WARNING) { reached = t; return status; }
    /* The solution from turn to turn, u held. */
    for (;;) {
        double level = unit->u / unit->k;
        double need = level < 0.5 ? log((unit->x - level) / (0.5 - level)) / unit->k : INFINITY;
        if (need > rest) { unit->x = level + (unit->x - level) * exp(-unit->k * rest); break; }
        rest -= need;
        unit->x = 1;
        unit->count++;
        if (unit->trouble == TERMINATES) { reached = t + h - rest; ended = 1; return DISCARD; }
    }
    unit->t = t + h;
    return OK;
}
Status fmi2GetRealStatus(Component c, int kind, double *v) { (void)c; (void)kind; *v = reached; return OK; }
Status fmi2GetBooleanStatus(Component c, int kind, int *v) { (void)c; (void)kind; *v = ended; return OK; }
