/* A second importer, in C with the headers of the interface: that signatures are those of the headers, that instances in threads know
   nothing of each other, and (below valgrind) that no byte is lost or read that is not there.
   Usage: client LIBRARY RESOURCES TOKEN, for the unit of `bounce.hyd` of version 3.0; HEIGHT and VELOCITY are its value references. */
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

static void *library;
static const char *resources, *token;
static fmi3ValueReference height, velocity;
static int messages;

#define FUNCTION(name) static name##TYPE *get_##name(void) { return (name##TYPE *)dlsym(library, #name); }
FUNCTION(fmi3GetVersion)
FUNCTION(fmi3InstantiateCoSimulation)
FUNCTION(fmi3InstantiateModelExchange)
FUNCTION(fmi3FreeInstance)
FUNCTION(fmi3EnterInitializationMode)
FUNCTION(fmi3ExitInitializationMode)
FUNCTION(fmi3DoStep)
FUNCTION(fmi3GetFloat64)
FUNCTION(fmi3GetFMUState)
FUNCTION(fmi3SetFMUState)
FUNCTION(fmi3FreeFMUState)
FUNCTION(fmi3SerializedFMUStateSize)
FUNCTION(fmi3SerializeFMUState)
FUNCTION(fmi3DeserializeFMUState)
FUNCTION(fmi3UpdateDiscreteStates)
FUNCTION(fmi3EnterContinuousTimeMode)
FUNCTION(fmi3SetTime)
FUNCTION(fmi3SetContinuousStates)
FUNCTION(fmi3GetContinuousStates)
FUNCTION(fmi3GetContinuousStateDerivatives)
FUNCTION(fmi3GetEventIndicators)
FUNCTION(fmi3CompletedIntegratorStep)
FUNCTION(fmi3Terminate)

#define CHECK(condition)                                                    \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition);         \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

static void told(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment;
    CHECK(category != NULL && strlen(message) > 0);
    if (status >= fmi3Error) messages++;
}

static int looked;

static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                   fmi3Boolean early, fmi3Boolean *wanted, fmi3Float64 *wanted_time) {
    (void)set, (void)finished, (void)early;
    fmi3Instance *unit = environment;
    fmi3Float64 value;
    /* Values may be asked for from within a step. */
    CHECK(get && get_fmi3GetFloat64()(*unit, &height, 1, &value, 1) == fmi3OK);
    CHECK(value > -1e-6 && value <= 1 && time >= 0);
    *wanted = fmi3False;
    *wanted_time = time;
    looked++;
}

static fmi3Float64 read_one(fmi3Instance unit, fmi3ValueReference reference) {
    fmi3Float64 value = NAN;
    CHECK(get_fmi3GetFloat64()(unit, &reference, 1, &value, 1) == fmi3OK);
    return value;
}

static fmi3Status step(fmi3Instance unit, double t, double h) {
    fmi3Boolean event, end, early;
    fmi3Float64 last;
    return get_fmi3DoStep()(unit, t, h, fmi3True, &event, &end, &early, &last);
}

static void *run(void *argument) {
    double *result = argument;
    fmi3Instance unit = NULL;
    fmi3Instance *place = &unit;
    unit = get_fmi3InstantiateCoSimulation()("one", token, resources, fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0, place, told, NULL);
    CHECK(unit != NULL);
    CHECK(get_fmi3EnterInitializationMode()(unit, fmi3True, 1e-8, 0, fmi3True, 1.8) == fmi3OK);
    CHECK(get_fmi3ExitInitializationMode()(unit) == fmi3OK);
    for (int k = 0; k < 180; k++) CHECK(step(unit, k / 100.0, 0.01) == fmi3OK);
    *result = read_one(unit, height);
    CHECK(get_fmi3Terminate()(unit) == fmi3OK);
    get_fmi3FreeInstance()(unit);
    return NULL;
}

static void exchange(void) {
    fmi3Instance unit = get_fmi3InstantiateModelExchange()("two", token, resources, fmi3False, fmi3True, NULL, told);
    CHECK(unit != NULL);
    CHECK(get_fmi3EnterInitializationMode()(unit, fmi3False, 0, 0, fmi3False, 0) == fmi3OK);
    CHECK(get_fmi3ExitInitializationMode()(unit) == fmi3OK);
    fmi3Boolean a, b, c, d, e;
    fmi3Float64 next, x[2], dx[2], z[1];
    CHECK(get_fmi3UpdateDiscreteStates()(unit, &a, &b, &c, &d, &e, &next) == fmi3OK);
    CHECK(get_fmi3EnterContinuousTimeMode()(unit) == fmi3OK);
    for (int k = 0; k < 100; k++) {
        CHECK(get_fmi3GetContinuousStates()(unit, x, 2) == fmi3OK);
        CHECK(get_fmi3GetContinuousStateDerivatives()(unit, dx, 2) == fmi3OK);
        for (int i = 0; i < 2; i++) x[i] += 1e-3 * dx[i];
        CHECK(get_fmi3SetTime()(unit, 1e-3 * (k + 1)) == fmi3OK);
        CHECK(get_fmi3SetContinuousStates()(unit, x, 2) == fmi3OK);
        CHECK(get_fmi3CompletedIntegratorStep()(unit, fmi3True, &a, &b) == fmi3OK);
        CHECK(get_fmi3GetEventIndicators()(unit, z, 1) == fmi3OK);
    }
    CHECK(fabs(read_one(unit, velocity) + 0.981) < 1e-9);
    fmi3FMUState state = NULL, other = NULL;
    CHECK(get_fmi3GetFMUState()(unit, &state) == fmi3OK);
    CHECK(get_fmi3GetFMUState()(unit, &state) == fmi3OK);
    size_t size;
    CHECK(get_fmi3SerializedFMUStateSize()(unit, state, &size) == fmi3OK);
    fmi3Byte *bytes = malloc(size);
    CHECK(get_fmi3SerializeFMUState()(unit, state, bytes, size - 1) == fmi3Error);
    CHECK(get_fmi3SerializeFMUState()(unit, state, bytes, size) == fmi3OK);
    /* Every byte wrong once: refused, or another state, but never a crash. */
    for (size_t k = 0; k < size; k++) {
        bytes[k] ^= 0xff;
        if (get_fmi3DeserializeFMUState()(unit, bytes, size, &other) == fmi3OK && get_fmi3SetFMUState()(unit, other) == fmi3OK) {
            get_fmi3GetContinuousStateDerivatives()(unit, dx, 2);
            get_fmi3GetEventIndicators()(unit, z, 1);
        }
        bytes[k] ^= 0xff;
    }
    for (size_t k = 0; k < size; k++) CHECK(get_fmi3DeserializeFMUState()(unit, bytes, k, &other) == fmi3Error);
    CHECK(get_fmi3SetFMUState()(unit, state) == fmi3OK);
    CHECK(fabs(read_one(unit, velocity) + 0.981) < 1e-9);
    CHECK(get_fmi3SetFMUState()(unit, NULL) == fmi3Error);
    get_fmi3FreeFMUState()(unit, &state);
    get_fmi3FreeFMUState()(unit, &other);
    get_fmi3FreeFMUState()(unit, &other);
    free(bytes);
    get_fmi3FreeInstance()(unit);
}

int main(int count, char **arguments) {
    CHECK(count == 6);
    library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) fprintf(stderr, "%s\n", dlerror());
    CHECK(library != NULL);
    resources = arguments[2], token = arguments[3];
    height = (fmi3ValueReference)atoi(arguments[4]), velocity = (fmi3ValueReference)atoi(arguments[5]);
    CHECK(strcmp(get_fmi3GetVersion()(), "3.0") == 0);
    double alone, results[4];
    run(&alone);
    pthread_t threads[4];
    for (int k = 0; k < 4; k++) CHECK(pthread_create(&threads[k], NULL, run, &results[k]) == 0);
    for (int k = 0; k < 4; k++) CHECK(pthread_join(threads[k], NULL) == 0);
    for (int k = 0; k < 4; k++) CHECK(memcmp(&alone, &results[k], sizeof alone) == 0);
    fmi3Instance unit = NULL;
    unit = get_fmi3InstantiateCoSimulation()("three", token, resources, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, &unit, told, update);
    CHECK(unit != NULL);
    CHECK(step(unit, 0, 0.1) == fmi3Error && messages > 0);
    CHECK(get_fmi3EnterInitializationMode()(unit, fmi3True, 1e-8, 0, fmi3True, 1.8) == fmi3OK);
    CHECK(get_fmi3ExitInitializationMode()(unit) == fmi3OK);
    for (int k = 0; k < 18; k++) CHECK(step(unit, k / 10.0, 0.1) == fmi3OK);
    CHECK(looked > 18);
    CHECK(fabs(read_one(unit, height) - alone) < 1e-9);
    get_fmi3FreeInstance()(unit);
    unit = get_fmi3InstantiateCoSimulation()("four", "{other}", resources, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, NULL, told, NULL);
    CHECK(unit == NULL);
    exchange();
    printf("%.17g\n", alone);
    return 0;
}
