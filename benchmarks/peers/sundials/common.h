/* What both programs need of SUNDIALS: the process clock, and equations y' = rates(t, y) as it wants them. */
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

#define AT(v) N_VGetArrayPointer(v)

typedef void (*rates_fn)(double t, const double *y, double *f);
static rates_fn rates;

/* sign (c I - df/dy), the program's own */
static void matrix(double t, const double *y, double c, double sign, SUNMatrix m);

static double cpu(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int ida_residual(double t, N_Vector y, N_Vector yp, N_Vector r, void *u) {
  (void)u;
  rates(t, AT(y), AT(r));
  for (long k = 0; k < NV_LENGTH_S(y); k++) AT(r)[k] = AT(yp)[k] - AT(r)[k];
  return 0;
}
static int cvode_rates(double t, N_Vector y, N_Vector f, void *u) {
  (void)u;
  rates(t, AT(y), AT(f));
  return 0;
}
static int ida_matrix(double t, double c, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix m, void *u, N_Vector a, N_Vector b,
                      N_Vector d) {
  (void)yp, (void)r, (void)u, (void)a, (void)b, (void)d;
  matrix(t, AT(y), c, 1.0, m);
  return 0;
}
static int cvode_matrix(double t, N_Vector y, N_Vector f, SUNMatrix m, void *u, N_Vector a, N_Vector b, N_Vector d) {
  (void)f, (void)u, (void)a, (void)b, (void)d;
  matrix(t, AT(y), 0.0, -1.0, m);
  return 0;
}
